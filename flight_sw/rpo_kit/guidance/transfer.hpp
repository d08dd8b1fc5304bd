/// From one relative orbit to another, passively safe on the way.
///
/// State       a_roe of the chaser (deputy) relative to the TARGET (chief) [m], mean.
/// Method      Impulses half revolutions apart at the phase of the change of the eccentricity
///             vector, in closed form (support/orbit/closed_form_impulses.hpp), normal ones at that
///             of the inclination vector; all triples of opportunities within the time are tried,
///             and the cheapest that is safe is taken.
/// Safe        The radial/cross-track distance never falls below `keep_out_m`: at any stage of the
///             plan, and for two revolutions after the loss of any one burn or of all that follow
///             (support/orbit/passive_safety.hpp). Along-track distance counts for nothing, so this
///             bounds the keep-out sphere from outside.
/// Accuracy    First order in a_roe/a: 1 % of a leg from 30 km; the next leg makes up for it.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/guidance_test.cpp
#pragma once

#include <cstdint>

#include "support/orbit/burn.hpp"
#include "support/orbit/passive_safety.hpp"
#include "support/orbit/relative_elements.hpp"

namespace rpo_kit {

constexpr int kMostBurns = 6;

struct TransferOptions {
  double keep_out_m = 10.0;
  double lead_s = 120.0;         ///< from now to the first burn, at least
  double least_burn_mps = 1e-5;  ///< smaller ones are left out
};

struct Transfer {
  flight_support::Burn burns[kMostBurns];  ///< by ascending time, of the chaser
  int count = 0;
  std::int64_t end_ns = 0;
  double delta_v_mps = 0.0;
  double safe_m = 0.0;  ///< least radial/cross-track distance, any loss of burns included
};

/// @param goal  a_roe at `end_ns`.
/// @return false: no triple of opportunities in that time, or none that is safe.
bool plan_transfer(const flight_support::RelativeOrbit& now,
                   const flight_support::RelativeElements& goal, std::int64_t end_ns,
                   const TransferOptions& options, Transfer* transfer);

/// What two axes apart would cost at least [m/s]: n a (|d di| + max(|d de|, |d da|) / 2), and not
/// less than what the change of a*dl asks for.
double least_delta_v_mps(const flight_support::RelativeOrbit& now,
                         const flight_support::RelativeElements& goal, std::int64_t end_ns);

/// Least radial/cross-track distance in the next two revolutions less `sigmas` standard deviations
/// in the direction in question, if nothing is done; 0 at least.
double uncertain_safe_m(const flight_support::RelativeOrbit& now,
                        const flight_support::Matrix6& covariance, double sigmas);

}  // namespace rpo_kit
