#include <orrery/models/ccsds/odm_io.hpp>
#include <orrery/models/ccsds/oem_interpolation.hpp>

#include <algorithm>
#include <stdexcept>

namespace orrery {
namespace {

constexpr int kHighestDegree = 100;

struct Span {
  CcsdsEpoch from, until;
};

Span useable_span(const OemSegment& segment) {
  if (segment.states.empty())
    throw std::invalid_argument("interpolate: a segment of the OEM has no states");
  const OemMetadata& m = segment.metadata;
  const CcsdsEpoch first = segment.states.front().epoch, last = segment.states.back().epoch;
  return {std::max(first, m.useable_start_time.value_or(first)),
          std::min(last, m.useable_stop_time.value_or(last))};
}

std::string covered(const Oem& oem) {
  std::string text;
  for (const OemSegment& segment : oem.segments) {
    const Span span = useable_span(segment);
    if (!text.empty()) text += ", ";
    text += to_text(span.from) + " to " + to_text(span.until);
  }
  return text;
}

// Epochs compare within one time system, which a message has.
std::size_t segment_at(const Oem& oem, const CcsdsEpoch& epoch, const std::string& shown) {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < oem.segments.size(); ++i) {
    const Span span = useable_span(oem.segments[i]);
    if (epoch < span.from || epoch > span.until) continue;
    // Where one ends and the next begins, the next one holds: it stands for what a manoeuvre did.
    if (found && useable_span(oem.segments[*found]).until != epoch && span.until != epoch)
      throw std::invalid_argument("interpolate: segments " + std::to_string(*found + 1) + " and " +
                                  std::to_string(i + 1) + " of the OEM both cover " + shown);
    if (!found || span.until != epoch) found = i;
  }
  if (!found)
    throw std::out_of_range("interpolate: t = " + shown + " is not covered by the OEM of " +
                            oem.segments.front().metadata.object_name + ": " + covered(oem));
  return *found;
}

OemInterpolation method_of(const OemMetadata& metadata,
                           const std::optional<OemInterpolation>& otherwise) {
  OemInterpolation how;
  if (metadata.interpolation && metadata.interpolation_degree) {
    how = {*metadata.interpolation, *metadata.interpolation_degree};
  } else if (otherwise) {
    how = *otherwise;
  } else {
    throw std::invalid_argument("interpolate: the OEM of " + metadata.object_name +
                                " lacks INTERPOLATION or INTERPOLATION_DEGREE; ask for an epoch of "
                                "one of its lines, or pass "
                                "a method");
  }
  if (how.degree < 1 || how.degree > kHighestDegree)
    throw std::invalid_argument("interpolate: degree = " + std::to_string(how.degree) +
                                "; accepted: 1 to " + std::to_string(kHighestDegree));
  if (how.method == InterpolationMethod::kLinear) how.degree = 1;
  return how;
}

/// The lines around an instant; times in seconds from it.
struct Nodes {
  std::vector<double> t_s;
  const OemState* states = nullptr;
};

// `after`: the first line after t. There is one before it.
Nodes nodes_around(const OemSegment& segment, std::size_t after, SimTime t, std::size_t count) {
  const std::vector<OemState>& states = segment.states;
  if (states.size() < count)
    throw std::invalid_argument("interpolate: the degree needs " + std::to_string(count) +
                                " lines; the segment of the OEM has " +
                                std::to_string(states.size()));
  const auto seconds_to = [&](std::size_t i) {
    return to_seconds(to_sim_time(states[i].epoch, segment.metadata.time_system) - t);
  };
  // As many before as after; of an odd number one more on the side of the nearer line.
  const bool one_more_before = count % 2 == 1 && -seconds_to(after - 1) < seconds_to(after);
  const std::size_t before = std::min(after, count / 2 + (one_more_before ? 1 : 0));
  const std::size_t begin = std::min(after - before, states.size() - count);
  Nodes nodes;
  nodes.states = &states[begin];
  for (std::size_t i = begin; i < begin + count; ++i) nodes.t_s.push_back(seconds_to(i));
  return nodes;
}

void lagrange(const Nodes& nodes, OemPoint& point) {
  point.r_km = point.v_kmps = {};
  for (std::size_t i = 0; i < nodes.t_s.size(); ++i) {
    double weight = 1;
    for (std::size_t j = 0; j < nodes.t_s.size(); ++j) {
      if (j != i) weight *= -nodes.t_s[j] / (nodes.t_s[i] - nodes.t_s[j]);
    }
    point.r_km += weight * nodes.states[i].r_km;
    point.v_kmps += weight * nodes.states[i].v_kmps;
  }
}

// Newton's divided differences with every node twice; Stoer & Bulirsch, Introduction to Numerical
// Analysis (2002), 2.1.5. Time in units of the nodes' span, so that powers of it stay near 1.
void hermite(const Nodes& nodes, OemPoint& point) {
  const double unit_s = nodes.t_s.back() - nodes.t_s.front();
  const std::size_t n = 2 * nodes.t_s.size();
  std::vector<double> x(n);
  std::vector<Vec3> c(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = nodes.t_s[i / 2] / unit_s;
    c[i] = nodes.states[i / 2].r_km;
  }
  for (std::size_t order = 1; order < n; ++order) {
    for (std::size_t i = n - 1; i >= order; --i) {
      const bool twice = order == 1 && i % 2 == 1;
      c[i] =
          twice ? unit_s * nodes.states[i / 2].v_kmps : (c[i] - c[i - 1]) / (x[i] - x[i - order]);
    }
  }
  Vec3 value = c[n - 1], derivative;
  for (std::size_t i = n - 1; i-- > 0;) {
    derivative = value - x[i] * derivative;
    value = c[i] - x[i] * value;
  }
  point.r_km = value;
  point.v_kmps = derivative / unit_s;
}

}  // namespace

OemPoint interpolate(const Oem& oem, SimTime t, const std::optional<OemInterpolation>& otherwise) {
  if (oem.segments.empty()) throw std::invalid_argument("interpolate: the OEM has no segments");
  const TimeSystem system = oem.segments.front().metadata.time_system;
  const CcsdsEpoch epoch = to_epoch(t, system);

  OemPoint point;
  point.segment = segment_at(oem, epoch, to_text(epoch) + " " + std::string(name_of(system)));
  const OemSegment& segment = oem.segments[point.segment];
  const auto after = std::upper_bound(
      segment.states.begin(), segment.states.end(), epoch,
      [](const CcsdsEpoch& instant, const OemState& state) { return instant < state.epoch; });
  const OemState& at_or_before = *(after - 1);
  if (at_or_before.epoch == epoch) {
    point.r_km = at_or_before.r_km;
    point.v_kmps = at_or_before.v_kmps;
    return point;
  }

  const OemInterpolation how = method_of(segment.metadata, otherwise);
  const std::size_t lines = static_cast<std::size_t>(how.degree) + 1;
  const std::size_t next = static_cast<std::size_t>(after - segment.states.begin());
  if (how.method == InterpolationMethod::kHermite) {
    hermite(nodes_around(segment, next, t, std::max<std::size_t>(2, (lines + 1) / 2)), point);
  } else {
    lagrange(nodes_around(segment, next, t, lines), point);
  }
  return point;
}

OrbitState state_at(const Oem& oem, SimTime t, const std::optional<OemInterpolation>& otherwise) {
  const OemPoint point = interpolate(oem, t, otherwise);
  ccsds::require_geocentric_eme2000(oem.segments[point.segment].metadata, "state_at");
  OrbitState state;
  state.t = t;
  state.r_ECI = 1e3 * point.r_km;
  state.v_ECI = 1e3 * point.v_kmps;
  return state;
}

}  // namespace orrery
