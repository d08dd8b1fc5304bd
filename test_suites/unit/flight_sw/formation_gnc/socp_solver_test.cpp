#include "formation_gnc/control/socp_solver.hpp"

#include <gtest/gtest.h>

#include "../flight_test_support.hpp"

namespace formation_gnc {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using flight_test::Noise;

VectorXd random_vector(int size, Noise* noise) {
  VectorXd v(size);
  for (double& x : v) x = noise->normal();
  return v;
}

MatrixXd random_matrix(int rows, int columns, Noise* noise) {
  MatrixXd m(rows, columns);
  for (int c = 0; c < columns; ++c) {
    for (int r = 0; r < rows; ++r) m(r, c) = noise->normal();
  }
  return m;
}

// How far v is outside the cone; 0 inside.
double outside(const VectorXd& v, int orthant, const std::vector<int>& cones) {
  double worst = 0.0;
  for (int k = 0; k < orthant; ++k) worst = std::fmax(worst, -v[k]);
  int first = orthant;
  for (const int size : cones) {
    worst = std::fmax(worst, v.segment(first + 1, size - 1).norm() - v[first]);
    first += size;
  }
  return worst;
}

// The conditions of Karush, Kuhn and Tucker, worked out here.
void expect_optimal(const DenseSocp& p, const SocpSolution& found, double tolerance) {
  ASSERT_EQ(found.status, SocpStatus::kOptimal) << to_string(found.status) << found.message;
  const double scale_c = 1.0 + p.c.norm(), scale_b = 1.0 + p.b.norm(), scale_h = 1.0 + p.h.norm();
  VectorXd dual = p.c + p.G.transpose() * found.z;
  if (p.b.size() > 0) {
    dual += p.A.transpose() * found.y;
    EXPECT_LT((p.A * found.x - p.b).norm(), tolerance * scale_b);
  }
  EXPECT_LT(dual.norm(), tolerance * scale_c);
  EXPECT_LT((p.G * found.x + found.s - p.h).norm(), tolerance * scale_h);
  EXPECT_EQ(outside(found.s, p.orthant, p.cones), 0.0);
  EXPECT_EQ(outside(found.z, p.orthant, p.cones), 0.0);
  const double cost = p.c.dot(found.x), bound = -p.b.dot(found.y) - p.h.dot(found.z);
  EXPECT_LT(std::fabs(cost - bound), tolerance * (1.0 + std::fabs(cost)));
  EXPECT_NEAR(found.primal_objective, cost, 1e-12 * (1.0 + std::fabs(cost)));
  EXPECT_NEAR(found.dual_objective, bound, 1e-12 * (1.0 + std::fabs(cost)));
}

// A problem with a known solution: s and z are chosen first, complementary in each cone (one inside
// and the other zero, or both on the border and opposite), then b, h and c so that the conditions
// hold.
struct Planted {
  DenseSocp problem;
  double cost;
};
Planted with_solution(int n, int p, const VectorXd& s, const VectorXd& z, int orthant,
                      const std::vector<int>& cones, Noise* noise) {
  Planted made;
  DenseSocp& d = made.problem;
  d.A = random_matrix(p, n, noise);
  d.G = random_matrix(static_cast<int>(s.size()), n, noise);
  const VectorXd x = random_vector(n, noise), y = random_vector(p, noise);
  d.b = d.A * x;
  d.h = d.G * x + s;
  d.c = -d.A.transpose() * y - d.G.transpose() * z;
  d.orthant = orthant;
  d.cones = cones;
  made.cost = d.c.dot(x);
  return made;
}
Planted planted(int n, int p, int orthant, const std::vector<int>& cones, Noise* noise) {
  int rows = orthant;
  for (const int size : cones) rows += size;
  VectorXd s = VectorXd::Zero(rows), z = VectorXd::Zero(rows);
  for (int k = 0; k < orthant; ++k) (k % 2 == 0 ? s : z)[k] = 0.1 + noise->uniform();
  int first = orthant;
  for (std::size_t k = 0; k < cones.size(); ++k) {
    const VectorXd u = random_vector(cones[k] - 1, noise);
    const double t = u.norm() + (k % 3 == 0 ? 0.0 : 0.5);
    if (k % 3 != 2) s.segment(first, cones[k]) << t, u;
    if (k % 3 == 0) z.segment(first, cones[k]) << 0.7 * t, -0.7 * u;
    if (k % 3 == 2) z.segment(first, cones[k]) << t, u;
    first += cones[k];
  }
  return with_solution(n, p, s, z, orthant, cones, noise);
}

TEST(SocpSolverTest, FindsPlantedSolutionsOfRandomProblems) {
  int most_iterations = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Noise noise(seed);
    const int n = 2 + static_cast<int>(seed % 9);
    const std::vector<int> cones =
        seed % 4 == 0 ? std::vector<int>{} : std::vector<int>{3, 4, 1, 6, 2};
    const Planted made = planted(n, static_cast<int>(seed % 3) % n, n + 3, cones, &noise);
    const SocpSolution found = SocpSolver().solve(made.problem);
    SCOPED_TRACE(seed);
    // 1e-8 of the equilibrated problem; scales of rows and columns differ by some tens.
    expect_optimal(made.problem, found, 1e-6);
    EXPECT_NEAR(found.primal_objective, made.cost, 1e-6 * (1.0 + std::fabs(made.cost)));
    most_iterations = std::max(most_iterations, found.iterations);
  }
  EXPECT_LE(most_iterations, 20);
}

// Every vertex of {x: G x <= h} in three dimensions, by solving for each triple of planes.
double least_at_vertices(const DenseSocp& p) {
  double least = INFINITY;
  const int m = static_cast<int>(p.h.size());
  for (int i = 0; i < m; ++i) {
    for (int j = i + 1; j < m; ++j) {
      for (int k = j + 1; k < m; ++k) {
        flight_support::Mat3 planes;
        flight_support::Vec3 right, at;
        const int rows[3] = {i, j, k};
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < 3; ++c) planes(r, c) = p.G(rows[r], c);
          right[r] = p.h[rows[r]];
        }
        if (!solve(planes, right, &at)) continue;
        const VectorXd x = (VectorXd(3) << at[0], at[1], at[2]).finished();
        if ((p.G * x - p.h).maxCoeff() > 1e-9) continue;
        least = std::fmin(least, p.c.dot(x));
      }
    }
  }
  return least;
}

TEST(SocpSolverTest, LinearProgramsEndAtTheirBestVertex) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Noise noise(1000 + seed);
    DenseSocp p;
    p.orthant = 14;
    p.G.resize(14, 3);
    p.G << random_matrix(8, 3, &noise), MatrixXd::Identity(3, 3), -MatrixXd::Identity(3, 3);
    p.h = VectorXd::Constant(14, 3.0);
    for (int k = 0; k < 8; ++k) p.h[k] = 0.2 + noise.uniform();
    p.c = random_vector(3, &noise);
    const SocpSolution found = SocpSolver().solve(p);
    ASSERT_EQ(found.status, SocpStatus::kOptimal) << seed;
    EXPECT_NEAR(found.primal_objective, least_at_vertices(p), 1e-7) << seed;
  }
}

// min t with |x - g| <= t and a'x = beta: the distance of g from the plane; x is the foot.
TEST(SocpSolverTest, ProjectsOntoAPlane) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Noise noise(2000 + seed);
    const int n = 5;
    const VectorXd g = random_vector(n, &noise), a = random_vector(n, &noise);
    const double beta = noise.normal();
    DenseSocp p;
    p.c = VectorXd::Unit(n + 1, n);
    p.A = MatrixXd::Zero(1, n + 1);
    p.A.block(0, 0, 1, n) = a.transpose();
    p.b = VectorXd::Constant(1, beta);
    p.G = MatrixXd::Zero(n + 1, n + 1);
    p.G(0, n) = -1.0;
    p.G.block(1, 0, n, n) = -MatrixXd::Identity(n, n);
    p.h = VectorXd::Zero(n + 1);
    p.h.tail(n) = -g;
    p.cones = {n + 1};
    const SocpSolution found = SocpSolver().solve(p);
    expect_optimal(p, found, 1e-7);
    const double off = (a.dot(g) - beta) / a.squaredNorm();
    EXPECT_NEAR(found.primal_objective, std::fabs(off) * a.norm(), 1e-7);
    EXPECT_LT((found.x.head(n) - (g - off * a)).norm(), 1e-6);
  }
}

// The projection of (t, u) onto the cone |u| <= t, from outside both cone and polar, is
// (|u| + t)/2 (1, u/|u|).
TEST(SocpSolverTest, ProjectsOntoACone) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Noise noise(3000 + seed);
    const VectorXd u = random_vector(3, &noise);
    const double t = (2.0 * noise.uniform() - 1.0) * u.norm();
    const VectorXd g = (VectorXd(4) << t, u).finished();
    DenseSocp p;  // x is the projection, x_4 its distance
    p.c = VectorXd::Unit(5, 4);
    p.G = MatrixXd::Zero(9, 5);
    p.G.block(0, 0, 4, 4) = -MatrixXd::Identity(4, 4);
    p.G(4, 4) = -1.0;
    p.G.block(5, 0, 4, 4) = -MatrixXd::Identity(4, 4);
    p.h = VectorXd::Zero(9);
    p.h.tail(4) = -g;
    p.cones = {4, 5};
    const SocpSolution found = SocpSolver().solve(p);
    expect_optimal(p, found, 1e-7);
    VectorXd expected = (VectorXd(4) << 1.0, u / u.norm()).finished();
    expected *= 0.5 * (u.norm() + t);
    EXPECT_NEAR(found.primal_objective, (u.norm() - t) / std::sqrt(2.0), 1e-7) << seed;
    // Along the cone the distance d has a flat minimum: 1e-8 of it leaves sqrt(2e-8) d, 2e-4.
    // Observed 3e-5.
    EXPECT_LT((found.x.head(4) - expected).norm(), 2e-4) << seed;
  }
}

// Problems at the border of what is well posed: any number of cones may be inactive, magnitudes
// differ by 10^3, and often neither solution nor multipliers are unique. All 2400 of another 3000
// seeds that make a problem are solved, 18 of them as `inaccurate`, the cost to 1.3e-5 at worst.
TEST(SocpSolverTest, SolvesDegenerateProblems) {
  int tried = 0, inaccurate = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Noise noise(5000 + seed);
    const int n = 1 + static_cast<int>(25 * noise.uniform());
    const int p = static_cast<int>(0.6 * n * noise.uniform());
    const int orthant = static_cast<int>(20 * noise.uniform());
    std::vector<int> cones(static_cast<std::size_t>(8 * noise.uniform()));
    int rows = orthant;
    for (int& size : cones) rows += size = 1 + static_cast<int>(7 * noise.uniform());
    if (rows + p < n || rows < 1) continue;
    VectorXd s = VectorXd::Zero(rows), z = VectorXd::Zero(rows);
    const double active = noise.uniform();
    for (int k = 0; k < orthant; ++k) {
      VectorXd& positive = noise.uniform() < active ? z : s;
      positive[k] = std::exp(3.0 * noise.normal());
    }
    int first = orthant;
    for (const int size : cones) {
      const VectorXd u = random_vector(size - 1, &noise);
      const double t = u.norm(), which = noise.uniform();
      if (which < 0.67) {
        (which < 0.33 ? s : z).segment(first, size) << t + 0.1, u;
      } else if (size > 1) {
        s.segment(first, size) << t, u;
        z.segment(first, size) << t, -u;
      }
      first += size;
    }
    const Planted made = with_solution(n, p, s, z, orthant, cones, &noise);
    const SocpSolution found = SocpSolver().solve(made.problem);
    ASSERT_TRUE(found.solved()) << seed << " " << to_string(found.status);
    EXPECT_NEAR(found.primal_objective, made.cost, 1e-4 * (1.0 + std::fabs(made.cost))) << seed;
    ++tried;
    if (found.status == SocpStatus::kInaccurate) ++inaccurate;
  }
  EXPECT_GT(tried, 200);
  EXPECT_LT(inaccurate, tried / 20);
}

// x1 + x2 = 1 with x <= 0.4 each; in cones, |x| <= 1 with x1 = 2; equations that contradict each
// other, the third being the sum of the others but for b.
TEST(SocpSolverTest, ProvesThatNothingIsFeasible) {
  DenseSocp linear;
  linear.c = VectorXd::Ones(2);
  linear.A = MatrixXd::Ones(1, 2);
  linear.b = VectorXd::Ones(1);
  linear.G = MatrixXd::Identity(2, 2);
  linear.h = VectorXd::Constant(2, 0.4);
  linear.orthant = 2;
  DenseSocp conic;
  conic.c = VectorXd::Zero(3);
  conic.A = VectorXd::Unit(3, 0).transpose();
  conic.b = VectorXd::Constant(1, 2.0);
  conic.G = MatrixXd::Zero(4, 3);
  conic.G.block(1, 0, 3, 3) = -MatrixXd::Identity(3, 3);
  conic.h = VectorXd::Unit(4, 0);
  conic.cones = {4};
  DenseSocp contradiction = linear;
  contradiction.A = (MatrixXd(3, 2) << 1, 2, 3, -1, 4, 1).finished();
  contradiction.b = (VectorXd(3) << 0.1, 0.2, 0.4).finished();
  for (const DenseSocp& p : {linear, conic, contradiction}) {
    const SocpSolution found = SocpSolver().solve(p);
    ASSERT_EQ(found.status, SocpStatus::kPrimalInfeasible) << to_string(found.status);
    EXPECT_NEAR(p.b.dot(found.y) + p.h.dot(found.z), -1.0, 1e-12);
    EXPECT_LT((p.A.transpose() * found.y + p.G.transpose() * found.z).norm(), 1e-7);
    EXPECT_EQ(outside(found.z, p.orthant, p.cones), 0.0);
  }
}

// min -x1 with x1 - x2 = 0 and x >= 0; and min x2 with |x1| <= -x2.
TEST(SocpSolverTest, ProvesThatTheCostHasNoBound) {
  DenseSocp linear;
  linear.c = -VectorXd::Unit(2, 0);
  linear.A = (MatrixXd(1, 2) << 1, -1).finished();
  linear.b = VectorXd::Zero(1);
  linear.G = -MatrixXd::Identity(2, 2);
  linear.h = VectorXd::Zero(2);
  linear.orthant = 2;
  DenseSocp conic;
  conic.c = VectorXd::Unit(2, 1);
  conic.G = (MatrixXd(2, 2) << 0, 1, 1, 0).finished();
  conic.h = VectorXd::Zero(2);
  conic.cones = {2};
  for (const DenseSocp& p : {linear, conic}) {
    const SocpSolution found = SocpSolver().solve(p);
    ASSERT_EQ(found.status, SocpStatus::kDualInfeasible) << to_string(found.status);
    EXPECT_NEAR(p.c.dot(found.x), -1.0, 1e-12);
    if (p.b.size() > 0) {
      EXPECT_LT((p.A * found.x).norm(), 1e-7);
    }
    EXPECT_LT((p.G * found.x + found.s).norm(), 1e-7);
    EXPECT_EQ(outside(found.s, p.orthant, p.cones), 0.0);
  }
}

// A variable that no cone holds: standard form min c'x, A x = b, x_1 >= 0, x_2 free.
TEST(SocpSolverTest, TakesVariablesThatNoConeHolds) {
  DenseSocp p;
  p.c = (VectorXd(3) << 1, 0, 1).finished();
  p.A = (MatrixXd(2, 3) << 1, 1, 0, 0, 2, -1).finished();
  p.b = (VectorXd(2) << 3, 1).finished();
  p.G = MatrixXd::Zero(2, 3);
  p.G(0, 0) = p.G(1, 2) = -1.0;
  p.h = VectorXd::Zero(2);
  p.orthant = 2;
  const SocpSolution found = SocpSolver().solve(p);
  expect_optimal(p, found, 1e-7);
  // x2 = 3 - x1, x3 = 2 x2 - 1 = 5 - 2 x1 >= 0: the cost 5 - x1 is least at x1 = 2.5.
  EXPECT_NEAR(found.primal_objective, 2.5, 1e-7);
  EXPECT_NEAR(found.x[1], 0.5, 1e-7);
}

// A row that repeats another, twice as large.
TEST(SocpSolverTest, TakesDependentButConsistentEquations) {
  Noise noise(7);
  Planted made = planted(6, 2, 8, {4, 3}, &noise);
  DenseSocp& p = made.problem;
  p.A.conservativeResize(3, 6);
  p.A.row(2) = 2.0 * p.A.row(0);
  p.b.conservativeResize(3);
  p.b[2] = 2.0 * p.b[0];
  const SocpSolution found = SocpSolver().solve(p);
  expect_optimal(p, found, 1e-6);
  EXPECT_NEAR(found.primal_objective, made.cost, 1e-6 * (1.0 + std::fabs(made.cost)));
}

// Many optima: the whole edge x1 + x2 = 1.
TEST(SocpSolverTest, SettlesOnOneOfManyOptima) {
  DenseSocp p;
  p.c = VectorXd::Ones(2);
  p.G.resize(3, 2);
  p.G << -1, -1, -1, 0, 0, -1;
  p.h = (VectorXd(3) << -1, 0, 0).finished();
  p.orthant = 3;
  const SocpSolution found = SocpSolver().solve(p);
  expect_optimal(p, found, 1e-7);
  EXPECT_NEAR(found.primal_objective, 1.0, 1e-7);
}

// Units that differ by 10^6 between variables and between rows: the cost does not change.
TEST(SocpSolverTest, UnitsDoNotMatter) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Noise noise(4000 + seed);
    const Planted made = planted(6, 2, 8, {4, 3, 5}, &noise);
    DenseSocp p = made.problem;
    const auto unit = [&] { return std::exp(13.8 * (noise.uniform() - 0.5)); };
    for (int j = 0; j < 6; ++j) {
      const double u = unit();
      p.A.col(j) *= u;
      p.G.col(j) *= u;
      p.c[j] *= u;
    }
    for (int i = 0; i < 2; ++i) {
      const double u = unit();
      p.A.row(i) *= u;
      p.b[i] *= u;
    }
    int row = 0;
    const auto scale_rows = [&](int size) {
      const double u = unit();
      p.G.middleRows(row, size) *= u;
      p.h.segment(row, size) *= u;
      row += size;
    };
    for (int k = 0; k < 8; ++k) scale_rows(1);
    for (const int size : p.cones) scale_rows(size);
    const SocpSolution found = SocpSolver().solve(p);
    ASSERT_TRUE(found.solved()) << seed << " " << to_string(found.status);
    EXPECT_NEAR(found.primal_objective, made.cost, 1e-5 * (1.0 + std::fabs(made.cost))) << seed;
  }
}

TEST(SocpSolverTest, RefusesMalformedProblems) {
  Noise noise(9);
  const DenseSocp good = planted(4, 1, 5, {3}, &noise).problem;
  const auto message_of = [](const DenseSocp& p, const SocpOptions& options = {}) {
    const SocpSolution found = SocpSolver(options).solve(p);
    EXPECT_EQ(found.status, SocpStatus::kBadInput);
    return std::string(found.message);
  };
  DenseSocp p = good;
  p.b.resize(2);
  EXPECT_EQ(message_of(p), "A has not as many rows as b");
  p = good;
  p.h[3] = NAN;
  EXPECT_EQ(message_of(p), "a number is not finite");
  p = good;
  p.cones = {4};
  EXPECT_EQ(message_of(p), "the cones have not as many rows as h");
  p = good;
  p.cones = {3, 0};
  EXPECT_EQ(message_of(p), "a cone has less than one row");
  EXPECT_EQ(message_of(good, {.tolerance = 0.0}), "tolerance is not in 1e-12 to 1e-2");
  EXPECT_EQ(message_of(good, {.max_iterations = 0}), "max_iterations is not in 1 to 10000");
}

TEST(SocpSolverTest, StopsAtTheIterationLimit) {
  Noise noise(11);
  const Planted made = planted(8, 2, 10, {4, 3, 5}, &noise);
  EXPECT_EQ(SocpSolver({.max_iterations = 2}).solve(made.problem).status,
            SocpStatus::kIterationLimit);
}

// The splitting of a reconfiguration: guide, section 7. `N` candidates over six revolutions,
// Keplerian drift, at most 3 mm/s each; v in mm/s.
SparseSocp splitting(int N) {
  const double n = 1.0948e-3, T = 6.0 * 2.0 * flight_support::kPi / n;
  const double goal[6] = {0, 0, 150, 80, 100, 120};
  std::vector<Eigen::Triplet<double>> A, G;
  for (int k = 0; k < N; ++k) {
    const double t = T * (k + 0.5) / N, u = n * t, s = std::sin(u), c = std::cos(u);
    const double m = 1e-3 / n;  // metres per mm/s
    const double B[6][3] = {{0, 2 * m, 0},         {-2 * m, -3.0 * n * (T - t) * m, 0},
                            {s * m, 2 * c * m, 0}, {-c * m, 2 * s * m, 0},
                            {0, 0, c * m},         {0, 0, s * m}};
    for (int r = 0; r < 6; ++r) {
      for (int a = 0; a < 3; ++a) {
        if (B[r][a] != 0.0) A.emplace_back(r, 4 * k + a, B[r][a]);
      }
    }
    G.emplace_back(k, 4 * k + 3, 1.0);
    G.emplace_back(N + 4 * k, 4 * k + 3, -1.0);
    for (int a = 0; a < 3; ++a) G.emplace_back(N + 4 * k + 1 + a, 4 * k + a, -1.0);
  }
  SparseSocp p;
  p.A.resize(6, 4 * N);
  p.A.setFromTriplets(A.begin(), A.end());
  p.G.resize(5 * N, 4 * N);
  p.G.setFromTriplets(G.begin(), G.end());
  p.b = Eigen::Map<const VectorXd>(goal, 6);
  p.h = VectorXd::Zero(5 * N);
  p.h.head(N).setConstant(3.0);
  p.c = VectorXd::Zero(4 * N);
  for (int k = 0; k < N; ++k) p.c[4 * k + 3] = 1.0;
  p.orthant = N;
  p.cones.assign(static_cast<std::size_t>(N), 4);
  return p;
}

// ECOS 2.0.10 on these problems: 268.4, 206.2 and 204.1 mm/s (guide, section 7), with candidates
// placed a little otherwise, which matters where few of them are all at their limit. Observed
// 268.78, 206.25 and 204.11 in 11, 13 and 15 iterations.
TEST(SocpSolverTest, SplitsAManoeuvreAsEcosDoes) {
  const struct {
    int N;
    double cost, tolerance;
  } cases[] = {{100, 268.4, 1.0}, {300, 206.2, 0.1}, {1000, 204.1, 0.06}};
  for (const auto& expected : cases) {
    const SocpSolution found = SocpSolver().solve(splitting(expected.N));
    ASSERT_EQ(found.status, SocpStatus::kOptimal) << to_string(found.status);
    EXPECT_NEAR(found.primal_objective, expected.cost, expected.tolerance) << expected.N;
    EXPECT_LE(found.iterations, 25) << expected.N;
    EXPECT_LT(found.primal_residual, 1e-7);
    EXPECT_LT(found.dual_residual, 1e-7);
  }
}

// With every zero of G stored the solver sees one block of all variables, and factors it as a full
// matrix: another way through the algebra to the same plan.
TEST(SocpSolverTest, OneFullBlockAgreesWithManySmallOnes) {
  const SparseSocp blocks = splitting(40);
  SparseSocp full = blocks;
  std::vector<Eigen::Triplet<double>> all;
  const MatrixXd G = blocks.G;
  for (int r = 0; r < G.rows(); ++r) {
    for (int c = 0; c < G.cols(); ++c) all.emplace_back(r, c, G(r, c));
  }
  full.G.setFromTriplets(all.begin(), all.end());
  ASSERT_EQ(full.G.nonZeros(), 200 * 160);
  full.h.head(40).setConstant(12.0);  // feasible with 40 candidates only so
  SparseSocp few = blocks;
  few.h = full.h;
  const SocpSolution a = SocpSolver().solve(few), b = SocpSolver().solve(full);
  ASSERT_EQ(a.status, SocpStatus::kOptimal);
  ASSERT_EQ(b.status, SocpStatus::kOptimal);
  EXPECT_NEAR(a.primal_objective, b.primal_objective, 1e-5);
  EXPECT_LT((a.x - b.x).norm(), 1e-3);  // mm/s, of 200
  const DenseSocp dense{few.c, few.A, few.G, few.b, few.h, few.orthant, few.cones};
  EXPECT_TRUE(SocpSolver().solve(dense).x == a.x);
}

}  // namespace
}  // namespace formation_gnc
