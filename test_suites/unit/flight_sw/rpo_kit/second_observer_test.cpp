#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "../flight_test_support.hpp"
#include "rpo_kit/far_range/relative_orbit_filter.hpp"
#include "rpo_kit/fusion/relative_navigation.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;
using flight_test::roe;

constexpr double kBearing_rad = 1e-4;

Vec3 unit_of(const Vec3& v) {
  return (1.0 / norm(v)) * v;
}

// A point from two lines of sight, another way: the least sum of weighted squares of its distances
// from both, three normal equations, and their inverse for its covariance.
struct Triangulation {
  Vec3 r;
  Mat3 covariance;
};
Triangulation triangulate(const Vec3& first, const Vec3& second, const Vec3& base,
                          double first_sigma_m, double second_sigma_m) {
  const Mat3 A =
      (1.0 / (first_sigma_m * first_sigma_m)) * (identity<3>() - first * transpose(first));
  const Mat3 B =
      (1.0 / (second_sigma_m * second_sigma_m)) * (identity<3>() - second * transpose(second));
  Triangulation at;
  EXPECT_TRUE(solve(A + B, B * base, &at.r));
  EXPECT_TRUE(solve(A + B, identity<3>(), &at.covariance));
  return at;
}

TEST(SecondObserverTest, LinesOfSightMeetWhereTheNormalEquationsSay) {
  Noise noise(3);
  for (int k = 0; k < 200; ++k) {
    const Vec3 target = noise.normal3(20e3), base = noise.normal3(4e3);
    const Vec3 first = unit_of(unit_of(target) + noise.normal3(kBearing_rad));
    const Vec3 second = unit_of(unit_of(target - base) + noise.normal3(kBearing_rad));
    Intersection at;
    ASSERT_TRUE(intersect(first, second, base, &at));
    // Of equal weights it is the middle of the shortest line between the two.
    const Vec3 middle = 0.5 * (at.first_m * first + base + at.second_m * second);
    const double tolerance_m = 1e-9 * norm(target) / (at.sine * at.sine);
    EXPECT_LT(norm(middle - triangulate(first, second, base, 1.0, 1.0).r), tolerance_m) << k;
    EXPECT_NEAR(at.miss_m, norm(at.first_m * first - base - at.second_m * second), tolerance_m);
    EXPECT_NEAR(at.sine, norm(cross(first, second)), 1e-15);
  }
  Intersection at;
  EXPECT_FALSE(intersect(vec3(1, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), &at));
  ASSERT_TRUE(intersect(vec3(1, 0, 0), vec3(0, 1, 0), vec3(5, 3, 2), &at));
  EXPECT_EQ(at.first_m, 5.0);
  EXPECT_EQ(at.second_m, -3.0);  // behind it
  EXPECT_EQ(at.miss_m, 2.0);
}

// Target, chaser and a second observer, each around an oblate Earth numerically.
class ThreeOrbits {
 public:
  ThreeOrbits(std::uint64_t seed, const RelativeElements& target, const RelativeElements& second)
      : noise_(seed) {
    const OrbitElements own = flight_test::reference_chief();
    own_ = flight_test::state_of_mean(own);
    target_ = flight_test::state_of_mean(apply_relative_elements(own, target));
    second_ = flight_test::state_of_mean(apply_relative_elements(own, second));
  }
  void run_to(double t_s) {
    for (StateEci* s : {&own_, &target_, &second_}) {
      *s = flight_test::propagate_oblate(*s, t_s - t_s_);
    }
    t_s_ = t_s;
  }
  std::int64_t now_ns() const { return kEpoch_ns + nanoseconds(t_s_); }
  Vec3 towards_target() const { return target_.r_ECI - own_.r_ECI; }
  Vec3 base() const { return second_.r_ECI - own_.r_ECI; }
  Observer own() const { return observer_from_state(now_ns(), own_); }
  EciFix own_fix() {
    return {
        now_ns(), {own_.r_ECI + noise_.normal3(1.5), own_.v_ECI + noise_.normal3(0.03)}, 1.5, 0.03};
  }
  Bearing bearing() {
    return {now_ns(), unit_of(unit_of(towards_target()) + noise_.normal3(kBearing_rad)),
            kBearing_rad};
  }
  SecondBearing second() {
    const Vec3 d = unit_of(target_.r_ECI - second_.r_ECI);
    return {now_ns(), unit_of(d + noise_.normal3(kBearing_rad)), kBearing_rad,
            second_.r_ECI + noise_.normal3(1.5), 2.25 * identity<3>()};
  }
  RelativeElements a_roe() const {  // of the chaser relative to the target
    return relative_elements(flight_test::mean_of_state(target_), flight_test::mean_of_state(own_));
  }

 private:
  Noise noise_;
  StateEci own_, target_, second_;
  double t_s_ = 0.0;
};

const RelativeElements kTarget = roe(0, 30000, -80, -290, -80, -290);
const RelativeElements kSecond = roe(0, 4000, 700, 2600, 700, 2600);

// One direction of each, and a prior of 100 m along the track and 50 m else: what is then known of
// the place is what the normal equations say of the two lines and the prior, to what second order
// in 100 m / 30 km leaves, 0.3 %, and the same of the range that turns angles into metres.
TEST(SecondObserverTest, UpdateIsThatOfAnIndependentTriangulation) {
  for (const double place_m : {0.0, 20.0}) {
    ThreeOrbits scene(5, kTarget, kSecond);
    RelativeElements off = kTarget;
    off[kDl] += 60.0;
    Matrix6 P = 2500.0 * identity<6>();
    P(kDl, kDl) = 1e4;
    RelativeOrbitFilter filter;
    const Observer own = scene.own();
    filter.start(own, off, P);
    // The prior of the place, from the elements', numerically.
    const Vec3 from = position_ECI(own.mean);
    const Vec3 before = target_position_ECI(own.mean, from, off);
    Matrix<3, 6> H;
    for (int k = 0; k < 6; ++k) {
      RelativeElements moved = off;
      moved[k] += 1.0;
      const Vec3 column = target_position_ECI(own.mean, from, moved) - before;
      for (int r = 0; r < 3; ++r) H(r, k) = column[r];
    }
    const Mat3 prior = H * P * transpose(H);
    const Bearing first = scene.bearing();
    const SecondBearing other = scene.second();
    const Bearing second{other.t_ns, other.direction_ECI, other.sigma_rad, scene.base(),
                         place_m * place_m * identity<3>()};
    ASSERT_TRUE(filter.update(first, own));
    ASSERT_TRUE(filter.update(second, own));
    const double first_m = kBearing_rad * norm(scene.towards_target());
    const double second_m =
        std::hypot(kBearing_rad * norm(scene.towards_target() - scene.base()), place_m);
    const Triangulation two =
        triangulate(first.direction_ECI, second.direction_ECI, scene.base(), first_m, second_m);
    Mat3 information, prior_information, expected;
    ASSERT_TRUE(solve(two.covariance, identity<3>(), &information));
    ASSERT_TRUE(solve(prior, identity<3>(), &prior_information));
    ASSERT_TRUE(solve(information + prior_information, identity<3>(), &expected));
    const Vec3 r = expected * (information * two.r + prior_information * before);
    const Vec3 after = target_position_ECI(own.mean, from, filter.a_roe());
    const Mat3 covariance = H * filter.covariance() * transpose(H);
    const Vec3 along = unit_of(scene.towards_target());
    const double expected_m = std::sqrt(dot(along, expected * along));
    EXPECT_NEAR(std::sqrt(dot(along, covariance * along)), expected_m, 0.01 * expected_m);
    // Of a correction of 60 m.
    EXPECT_LT(norm(after - r), 0.01 * 60.0) << place_m;
    // And it is the truth's, within four sigma, which is less than the prior's.
    EXPECT_LT(std::fabs(dot(along, after - scene.towards_target())), 4.0 * expected_m);
    EXPECT_LT(expected_m, (place_m == 0.0 ? 0.5 : 0.95) * std::sqrt(dot(along, prior * along)));
  }
}

struct Delivery {
  double late_s = 0.0;
  bool reversed = false, doubled = false;
};

// Own fixes each 10 s, directions of both each 120 s, those of the second by this delivery.
void fly(ThreeOrbits* scene, RelativeNavigation* navigation, int seconds,
         const Delivery& delivery) {
  struct Message {
    double due_s;
    SecondBearing bearing;
  };
  std::vector<Message> on_the_way;
  for (int s = 10; s <= seconds; s += 10) {
    scene->run_to(s);
    navigation->own_fix(scene->own_fix());
    if (s % 120 == 0) {
      navigation->bearing(scene->bearing());
      on_the_way.push_back({s + delivery.late_s, scene->second()});
    }
    if (delivery.reversed) std::reverse(on_the_way.begin(), on_the_way.end());
    std::vector<Message> later;
    for (const Message& m : on_the_way) {
      if (m.due_s > s) {
        later.push_back(m);
        continue;
      }
      navigation->second_bearing(m.bearing);
      if (delivery.doubled) navigation->second_bearing(m.bearing);
    }
    on_the_way = later;
    navigation->process(scene->now_ns());
  }
}

TEST(SecondObserverTest, StartsInHalfAnHourAndIsHonest) {
  double squares = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    ThreeOrbits scene(seed, kTarget, kSecond);
    RelativeNavigation navigation;
    fly(&scene, &navigation, 2100, {});
    ASSERT_TRUE(navigation.started()) << seed;
    RelativeOrbit now;
    Matrix6 P;
    ASSERT_TRUE(navigation.at(scene.now_ns(), &now, &P));
    const RelativeElements truth = scene.a_roe();
    EXPECT_NEAR(now.a_roe[kDl] / truth[kDl], 1.0, 0.03) << seed;
    squares += squared_mahalanobis(P, now.a_roe - truth) / 4.0;
  }
  // Six states of four seeds, chi-square with 24 degrees of freedom over 4: 1 in 10,000 at either
  // end.
  EXPECT_GT(squares, 1.5);
  EXPECT_LT(squares, 14.8);
  RecordProperty("nees", std::to_string(squares));
}

TEST(SecondObserverTest, LateReorderedOrDoubledWithinTheLagIsTheSame) {
  RelativeElements result[3];
  int dropped[3];
  const Delivery deliveries[3] = {{0.0, false, false}, {20.0, false, false}, {20.0, true, true}};
  for (int k = 0; k < 3; ++k) {
    ThreeOrbits scene(4, kTarget, kSecond);
    RelativeNavigation navigation;
    fly(&scene, &navigation, 2700, deliveries[k]);
    RelativeOrbit now;
    Matrix6 P;
    ASSERT_TRUE(navigation.at(scene.now_ns(), &now, &P));
    EXPECT_GT(navigation.used(Source::kSecond), 4);
    result[k] = now.a_roe;
    dropped[k] = navigation.dropped();
  }
  for (int k = 0; k < 6; ++k) {
    EXPECT_EQ(result[0][k], result[1][k]) << k;
    EXPECT_EQ(result[0][k], result[2][k]) << k;
  }
  EXPECT_EQ(dropped[0], 0);
  EXPECT_EQ(dropped[1], 0);
  EXPECT_EQ(dropped[2], 2700 / 120);  // each a second time
  // Beyond the lag it is as if there were none.
  ThreeOrbits scene(4, kTarget, kSecond);
  RelativeNavigation navigation;
  fly(&scene, &navigation, 2700, {40.0, false, false});
  EXPECT_FALSE(navigation.started());
  EXPECT_EQ(navigation.used(Source::kSecond), 0);
}

// Wrong ones before there is an estimate, and more of them than a restart would take afterwards;
// and a flood of them, which must not crowd out what the own sensors say.
TEST(SecondObserverTest, WrongOnesAreLeftOutAndNeverRestartTheFilter) {
  ThreeOrbits scene(6, kTarget, kSecond);
  RelativeNavigation navigation;
  Noise noise(9);
  const auto wrong = [&] {
    SecondBearing b = scene.second();
    b.direction_ECI = unit_of(noise.normal3(1.0));
    return b;
  };
  for (int s = 10; s <= 1900; s += 10) {
    scene.run_to(s);
    navigation.own_fix(scene.own_fix());
    if (s % 60 == 0) navigation.bearing(scene.bearing());
    if (s % 60 == 0) navigation.second_bearing(s % 120 == 0 ? wrong() : scene.second());
    navigation.process(scene.now_ns());
  }
  ASSERT_TRUE(navigation.started());
  EXPECT_GT(navigation.outliers(), 8);
  RelativeOrbit now;
  Matrix6 P;
  ASSERT_TRUE(navigation.at(scene.now_ns(), &now, &P));
  EXPECT_NEAR(now.a_roe[kDl] / scene.a_roe()[kDl], 1.0, 0.03);
  const int used = navigation.used(Source::kSecond);
  for (int s = 1910; s <= 4000; s += 10) {
    scene.run_to(s);
    navigation.own_fix(scene.own_fix());
    for (int k = 0; k < 50; ++k) {
      SecondBearing b = wrong();
      b.t_ns -= k;
      navigation.second_bearing(b);
    }
    navigation.process(scene.now_ns());
  }
  EXPECT_EQ(navigation.used(Source::kSecond), used);
  EXPECT_EQ(navigation.restarts(), 0);
  EXPECT_TRUE(navigation.started());
  Observer own;
  ASSERT_TRUE(navigation.own_at(scene.now_ns(), &own));
  EXPECT_LT(norm(position_ECI(own.mean) - position_ECI(scene.own().mean)), 20.0);
  ASSERT_TRUE(navigation.at(scene.now_ns(), &now, &P));
  EXPECT_LT(std::fabs(now.a_roe[kDl] - scene.a_roe()[kDl]), 4.0 * std::sqrt(P(kDl, kDl)));
}

}  // namespace
}  // namespace rpo_kit
