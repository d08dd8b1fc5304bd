// FormationGnc: what it says of itself, estimate and telemetry.
#include <algorithm>
#include <cmath>

#include "formation_gnc/mission/formation_gnc.hpp"

namespace formation_gnc {

using namespace flight_support;

void FormationGnc::send_estimate(const FormationEstimate& estimate) {
  const FormationEstimate e = from_chief(estimate);
  RelativeOutput output;
  output.t_ns = e.t_ns;
  for (int k = 0; k < 3; ++k) {
    output.r_DC_RTN[k] = e.r_relative_RTN[k];
    output.v_DC_RTN[k] = e.v_relative_RTN[k];
    output.sigma_r_m[k] = std::sqrt(std::max(0.0, e.relative_covariance_RTN(k, k)));
    output.sigma_v_mps[k] = std::sqrt(std::max(0.0, e.relative_covariance_RTN(k + 3, k + 3)));
  }
  out_.out_estimate(output);
}

// Whole cycles of deputy less chief, up to what all have in common.
void FormationGnc::fill_integers(formation_gnc_telemetry* t) const {
  const FormationFilter& filter = navigation_.filter();
  unsigned count = 0;
  for (int channel = 0; channel < kChannels; ++channel) {
    const CarrierArc& self = filter.arcs(Who::kSelf)[channel];
    const int at = self.prn != 0 ? filter.arcs(Who::kOther).find(self.prn) : -1;
    if (at < 0 || !filter.integers().holds(self.prn)) continue;
    const double cycles = filter.arcs(Who::kOther)[at].base_cycles - self.base_cycles +
                          filter.integers().value(self.prn);
    t->integer[count].prn = static_cast<unsigned>(self.prn);
    t->integer[count++].cycles = std::llround(is_deputy() ? -cycles : cycles);
  }
}

void FormationGnc::send_telemetry(std::int64_t now_ns, const FormationEstimate& estimate) {
  const TransitionProtocol& protocol = mission_.protocol();
  formation_gnc_telemetry t = {};
  t.role = static_cast<unsigned>(configuration_.role);
  t.mode = static_cast<std::uint32_t>(mode());
  t.t_ns = now_ns;
  if (estimate.valid) {
    const RelativeElements a_roe = relative_orbit(situation(estimate)).a_roe;
    const Matrix6& P = from_chief(estimate).relative_covariance_RTN;
    for (int k = 0; k < 6; ++k) t.a_roe_m[k] = a_roe[k];
    for (int k = 0; k < 3; ++k) {
      t.sigma_r_m[k] = std::sqrt(std::max(0.0, P(k, k)));
      t.sigma_v_mps[k] = std::sqrt(std::max(0.0, P(k + 3, k + 3)));
    }
  }
  t.delta_v_mps = delta_v_mps_;
  t.next_event_ns = protocol.has_pending() ? protocol.pending().begin_ns : 0;
  t.minimum_separation_m = forecast_.minimum_m;
  t.boot_count = boot_count_;
  t.transition = protocol.record().executed_id;
  t.late = protocol.late();
  t.postponed = protocol.postponed();
  t.rejected = rejected_;
  t.burns = burns_;
  t.observations = observations_;
  t.skipped = skipped_ + protocol.withdrawn();
  t.retransmissions = crosslink_.link().retransmissions();
  t.fixed_ambiguities = static_cast<std::uint32_t>(estimate.fixed_ambiguities);
  t.plan_entries = mission_.plan().size();
  t.fault = is_emergency(mode()) ? protocol.record().fault : 0u;
  t.measurements_sent = measurements_sent_;
  t.measurements_heard = measurements_heard_;
  t.drag_difference_mps2 = from_chief(estimate).drag_difference_mps2;
  t.graphic = graphic_.telemetry();
  t.sdcp = sdcp_.telemetry();
  fill_integers(&t);
  for (int nozzle = 0; nozzle < ThrusterScale::kNozzles; ++nozzle) {
    t.nozzle_scale[nozzle] = burn_observer_.scale().scale(nozzle);
    t.sigma_nozzle_scale[nozzle] = burn_observer_.scale().sigma(nozzle);
  }
  t.flags = (estimate.valid ? 1u : 0u) | (estimate.fixed ? 2u : 0u) |
            (partner_heard_ns_ != 0 ? 4u : 0u) | (protocol.has_pending() ? 8u : 0u);
  unsigned char message[FORMATION_GNC_TELEMETRY_BYTES];
  formation_gnc_put_telemetry(message, &t);
  out_.out_telemetry(message, sizeof message);
}

}  // namespace formation_gnc
