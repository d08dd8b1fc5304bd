#include <orrery/models/gnss/novatel.hpp>

#include <benchmark/benchmark.h>

namespace orrery::novatel {
namespace {

const BestXyz kMessage{.r_ECEF = {6928137.25, -1234567.5, 345678.125},
                       .sigma_r_ECEF = {1.5, 1.5, 1.5},
                       .v_ECEF = {1234.5, 7345.25, -12.125},
                       .sigma_v_ECEF = {0.03, 0.03, 0.03}};

// What one epoch of a receiver costs beyond its physics: body, header, CRC, no allocation.
void BM_Novatel_EncodeBestXyzFrame(benchmark::State& state) {
  ByteBuffer frame;
  for (auto _ : state) {
    frame.clear();
    append_frame({.message_id = kBestXyzId, .t = from_ns(1'426'464'000'000'000'000)},
                 encode(kMessage), frame);
    benchmark::DoNotOptimize(frame.data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_Novatel_EncodeBestXyzFrame);

void BM_Novatel_Crc32(benchmark::State& state) {
  const ByteBuffer bytes(static_cast<std::size_t>(state.range(0)), std::byte{0x5A});
  for (auto _ : state) benchmark::DoNotOptimize(crc32(bytes));
  state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_Novatel_Crc32)->Arg(140)->Arg(4096);

}  // namespace
}  // namespace orrery::novatel
