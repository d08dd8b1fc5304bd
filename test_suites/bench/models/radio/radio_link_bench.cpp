#include <orrery/models/radio/radio_link.hpp>

#include <benchmark/benchmark.h>

#include <memory>

namespace orrery {
namespace {

// Fate of a message of 256 bytes every 10 s, bits inverted where that is its fate.
void send_messages(benchmark::State& state, const RadioLinkOptions& options) {
  RandomStreams streams(1);
  RadioLink link(options, streams, "dsc", "osc", std::make_shared<RadioMedium>());
  const LinkGeometry geometry{.r_from_ECI = {6.928e6, 0, 0}, .r_to_ECI = {6.928e6, 300, 100}};
  ByteBuffer bytes(256);
  SimTime t = from_ns(0);
  for (auto _ : state) {
    const LinkFate fate = link.send(t, bytes.size(), geometry);
    if (fate.has_bit_errors) link.invert_bits(bytes);
    benchmark::DoNotOptimize(fate);
    t += 10s;
  }
  state.SetItemsProcessed(state.iterations());
}

void BM_RadioLink_BlackoutAndDelay(benchmark::State& state) {
  send_messages(state, {});
}
BENCHMARK(BM_RadioLink_BlackoutAndDelay);

void BM_RadioLink_AllImpairments(benchmark::State& state) {
  send_messages(
      state,
      {.hold_in_blackout = true,
       .p_duplicate = 0.01,
       .p_truncate = 0.01,
       .bit_error_rate = 1e-4,
       .receiver_checks = false,
       .rate_bps = 9600,
       .queue_bytes = 4096,
       .half_duplex = true,
       .preserve_order = true,
       .mtu_bytes = 128,
       .fragment = true,
       .visibility = {.max_range_m = 1e6, .earth_occludes = true, .beam_half_angle_rad = 3.1}});
}
BENCHMARK(BM_RadioLink_AllImpairments);

}  // namespace
}  // namespace orrery
