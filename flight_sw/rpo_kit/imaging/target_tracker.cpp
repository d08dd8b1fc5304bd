#include "rpo_kit/imaging/target_tracker.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"

namespace rpo_kit {
namespace {

using flight_support::Mat3;
using flight_support::seconds;
using flight_support::Vec3;

constexpr std::size_t kMostTracks = 32;

Vec3 unit(const Vec3& v) {
  return (1.0 / norm(v)) * v;
}

int bits_among(std::uint32_t history, int frames) {
  int count = 0;
  for (int k = 0; k < frames; ++k) count += static_cast<int>((history >> k) & 1u);
  return count;
}

}  // namespace

// A hot pixel gives the same centroid again and again, on the centre of a pixel (or between two);
// a source drifts, and has noise.
bool TargetTracker::is_hot(const Detection& detection) {
  if (detection.sharpness > hot_sharpness_) return true;
  for (Stuck& place : stuck_) {
    if (std::fabs(place.u - detection.u) > options_.stuck_px ||
        std::fabs(place.v - detection.v) > options_.stuck_px) {
      continue;
    }
    if (!place.seen) ++place.frames;
    place.seen = true;
    return place.frames >= options_.stuck_frames;
  }
  stuck_.push_back({detection.u, detection.v, 1, true});
  return false;
}

bool TargetTracker::is_star(const UnknownSource& source) {
  bool star = false;
  for (const std::vector<UnknownSource>& frame : before_) {
    for (std::size_t k = 0; k < frame.size(); ++k) {
      const double reach = options_.sigmas * std::hypot(source.sigma_rad, frame[k].sigma_rad);
      if (norm(source.direction_ECI - frame[k].direction_ECI) >= reach) continue;
      star = true;
      if (&frame == before_) was_star_[k] = true;
    }
  }
  return star;
}

double TargetTracker::gate_rad(const Track& track, double dt_s, double sigma_rad) const {
  const double n = options_.orbital_rate_radps;
  const double max_rate = options_.max_rate * n;
  if (track.hits < 2) return max_rate * dt_s;
  const double noise = std::hypot(track.sigma_rad, sigma_rad);
  // The rate is from two places `dt` apart, so its noise counts once more, and it is that of half
  // of `dt` ago.
  return options_.sigmas * 2.5 * noise + options_.curvature * max_rate * n * dt_s * dt_s;
}

void TargetTracker::hit(Track* track, const UnknownSource& source, const Vec3& direction_H,
                        std::int64_t t_ns) {
  const double dt_s = seconds(t_ns - track->t_ns);
  const Vec3 measured = (1.0 / dt_s) * (direction_H - track->direction_H);
  // The rate is followed rather than averaged: it turns with the relative orbit.
  track->rate_H = track->hits < 2 ? measured : track->rate_H + 0.7 * (measured - track->rate_H);
  track->direction_H = direction_H;
  track->t_ns = t_ns;
  track->sigma_rad = source.sigma_rad;
  track->flux_dn = source.detection.flux_dn;
  ++track->hits;
  track->history |= 1u;
}

// Each track takes the nearest source in its gate, tracks with most hits first.
void TargetTracker::associate(std::int64_t t_ns, const Mat3& R_HI,
                              const std::vector<UnknownSource>& sources) {
  std::stable_sort(tracks_.begin(), tracks_.end(),
                   [](const Track& a, const Track& b) { return a.hits > b.hits; });
  for (Track& track : tracks_) {
    const double dt_s = seconds(t_ns - track.t_ns);
    const Vec3 predicted = unit(track.direction_H + dt_s * track.rate_H);
    track.history <<= 1;
    track.source = -1;
    double nearest = INFINITY;
    for (std::size_t k = 0; k < sources.size(); ++k) {
      if (!usable_[k]) continue;
      const double flux = sources[k].detection.flux_dn;
      if (flux > options_.flux_ratio * track.flux_dn ||
          track.flux_dn > options_.flux_ratio * flux) {
        continue;
      }
      const double away = norm(R_HI * sources[k].direction_ECI - predicted);
      if (away < nearest && away < gate_rad(track, dt_s, sources[k].sigma_rad)) {
        nearest = away;
        track.source = static_cast<int>(k);
      }
    }
    if (track.source >= 0) {
      const std::size_t k = static_cast<std::size_t>(track.source);
      hit(&track, sources[k], R_HI * sources[k].direction_ECI, t_ns);
      usable_[k] = false;
    }
    if (bits_among(track.history, options_.confirm_frames) >= options_.confirm_hits &&
        track.hits >= options_.confirm_hits) {
      track.confirmed = true;
    }
  }
}

void TargetTracker::begin_tracks(std::int64_t t_ns, const Mat3& R_HI,
                                 const std::vector<UnknownSource>& sources) {
  for (std::size_t k = 0; k < sources.size() && tracks_.size() < kMostTracks; ++k) {
    if (!usable_[k]) continue;
    Track track;
    track.id = next_id_++;
    track.direction_H = R_HI * sources[k].direction_ECI;
    track.t_ns = t_ns;
    track.sigma_rad = sources[k].sigma_rad;
    track.flux_dn = sources[k].detection.flux_dn;
    track.hits = 1;
    track.history = 1u;
    track.source = static_cast<int>(k);
    tracks_.push_back(track);
  }
}

void TargetTracker::frame(std::int64_t t_ns, const Mat3& R_HI,
                          const std::vector<UnknownSource>& sources) {
  if (!tracks_.empty()) {
    // A frame of an instant that is past, or the same again, says nothing new.
    for (const Track& track : tracks_) {
      if (t_ns <= track.t_ns) return;
    }
  }
  usable_.assign(sources.size(), true);
  was_star_.assign(before_[0].size(), false);
  stars_ = hot_ = 0;
  for (Stuck& place : stuck_) place.seen = false;
  for (std::size_t k = 0; k < sources.size(); ++k) {
    if (is_hot(sources[k].detection)) {
      ++hot_;
      usable_[k] = false;
    } else if (is_star(sources[k])) {
      ++stars_;
      usable_[k] = false;
    }
  }
  stuck_.erase(std::remove_if(stuck_.begin(), stuck_.end(), [](const Stuck& s) { return !s.seen; }),
               stuck_.end());
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(),
                               [&](const Track& t) {
                                 return t.source >= 0 &&
                                        was_star_[static_cast<std::size_t>(t.source)];
                               }),
                tracks_.end());
  associate(t_ns, R_HI, sources);
  const std::uint32_t recent = (1u << options_.lost_frames) - 1u;
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(),
                               [&](const Track& t) {
                                 // An unconfirmed track has to be hit in one of two frames.
                                 return (t.history & (t.confirmed ? recent : 3u)) == 0;
                               }),
                tracks_.end());
  begin_tracks(t_ns, R_HI, sources);
  before_[2] = before_[1];
  before_[1] = before_[0];
  before_[0] = sources;
}

const Track* TargetTracker::target(const Vec3* predicted_H, double reach_rad) const {
  const Track* best = nullptr;
  double nearest = reach_rad;
  for (const Track& track : tracks_) {
    if (!track.confirmed) continue;
    if (predicted_H == nullptr) {
      if (best == nullptr || track.hits > best->hits) best = &track;
    } else if (norm(track.direction_H - *predicted_H) <= nearest) {
      nearest = norm(track.direction_H - *predicted_H);
      best = &track;
    }
  }
  return best;
}

}  // namespace rpo_kit
