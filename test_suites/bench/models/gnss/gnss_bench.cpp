#include <orrery/models/gnss/novatel_messages.hpp>

#include <benchmark/benchmark.h>

#include <vector>

#include "support/novatel/novatel.h"

namespace orrery::novatel {
namespace {

const BestXyz kMessage{.r_ECEF = {6928137.25, -1234567.5, 345678.125},
                       .sigma_r_ECEF = {1.5, 1.5, 1.5},
                       .v_ECEF = {1234.5, 7345.25, -12.125},
                       .sigma_v_ECEF = {0.03, 0.03, 0.03}};

const Header kHeader{.t = from_ns(1'426'464'000'000'000'000)};

// What one epoch of a receiver costs beyond its physics: body, header, CRC, no allocation.
void BM_Novatel_EncodeBestXyz(benchmark::State& state) {
  ByteBuffer frame;
  for (auto _ : state) {
    frame.clear();
    append(kHeader, kMessage, frame);
    benchmark::DoNotOptimize(frame.data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_Novatel_EncodeBestXyz);

std::vector<RangeObservation> twelve_satellites() {
  std::vector<RangeObservation> observations;
  for (std::uint16_t prn = 1; prn <= 12; ++prn) {
    observations.push_back({.prn = prn,
                            .pseudorange_m = 20e6 + 123'456.789 * prn,
                            .pseudorange_sigma_m = 0.25f,
                            .carrier_phase_cycles = 105e6 + 654'321.123 * prn,
                            .carrier_phase_sigma_cycles = 0.01f,
                            .doppler_Hz = -1234.5f,
                            .cn0_dBHz = 42.5f,
                            .lock_time_s = 600.0f});
  }
  return observations;
}

void encode_twelve(benchmark::State& state, decltype(append_range)* append_observations) {
  const std::vector<RangeObservation> observations = twelve_satellites();
  ByteBuffer frame;
  for (auto _ : state) {
    frame.clear();
    append_observations(kHeader, observations, frame);
    benchmark::DoNotOptimize(frame.data());
  }
  state.SetItemsProcessed(state.iterations());
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(frame.size()));
}
void BM_Novatel_EncodeRangeOf12(benchmark::State& state) {
  encode_twelve(state, append_range);
}
void BM_Novatel_EncodeRangeCmpOf12(benchmark::State& state) {
  encode_twelve(state, append_rangecmp);
}
BENCHMARK(BM_Novatel_EncodeRangeOf12);
BENCHMARK(BM_Novatel_EncodeRangeCmpOf12);

// The flight software's side: framing, CRC with its table of 64 bytes, and every field.
void BM_Novatel_DecodeRangeOf12(benchmark::State& state) {
  ByteBuffer stream;
  append_range(kHeader, twelve_satellites(), stream);
  const auto* const bytes = reinterpret_cast<const unsigned char*>(stream.data());
  unsigned char room[2048];
  novatel_framer framer;
  novatel_framer_init(&framer, room, sizeof room);
  std::uint32_t seen = 0;
  for (auto _ : state) {
    novatel_framer_write(&framer, bytes, stream.size());
    novatel_frame frame;
    while (novatel_framer_next(&framer, &frame) != 0) {
      novatel_observation observation;
      while (novatel_get_range(&frame, seen % 12, &observation) != 0 && ++seen % 12 != 0) {
        benchmark::DoNotOptimize(observation);
      }
    }
  }
  if (seen != 12 * state.iterations()) state.SkipWithError("frames were lost");
  state.SetItemsProcessed(state.iterations());
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(stream.size()));
}
BENCHMARK(BM_Novatel_DecodeRangeOf12);

void BM_Novatel_Crc32(benchmark::State& state) {
  const ByteBuffer bytes(static_cast<std::size_t>(state.range(0)), std::byte{0x5A});
  for (auto _ : state) benchmark::DoNotOptimize(crc32(bytes));
  state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_Novatel_Crc32)->Arg(140)->Arg(4096);

}  // namespace
}  // namespace orrery::novatel
