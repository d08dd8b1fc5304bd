// What the library may ask of the host within a call. What reads or writes flight memory does so as
// flight code; the rest is simulator code under SimulatorScope. A crash may leave these functions
// between any two lines.

#include <orrery/harness/flight/call_recording.hpp>
#include <orrery/harness/flight/flight_memory.hpp>
#include <orrery/harness/flight/flight_process_impl.hpp>

#include <algorithm>
#include <cstring>

namespace orrery {

using internal::copy_between;
using internal::SimulatorScope;
using Call = internal::LibraryCall;

void FlightProcess::Impl::fill_host_table() {
  host_.size = sizeof host_;
  host_.abi_version = ORRERY_ABI_VERSION;
  host_.context = this;
  host_.output = [](void* context, std::uint32_t port, const void* data, std::uint32_t bytes) {
    return static_cast<Impl*>(context)->output(port, data, bytes);
  };
  host_.request_tick = [](void* context, std::int64_t at_ns) {
    static_cast<Impl*>(context)->request_tick(at_ns);
  };
  host_.log = [](void* context, std::int32_t level, const char* line) {
    static_cast<Impl*>(context)->log(level, line);
  };
  host_.nv_load = [](void* context, std::uint32_t slot, void* buffer, std::uint32_t capacity) {
    return static_cast<Impl*>(context)->load_slot(slot, buffer, capacity);
  };
  host_.nv_store = [](void* context, std::uint32_t slot, const void* data, std::uint32_t bytes) {
    return static_cast<Impl*>(context)->store_slot(slot, data, bytes);
  };
}

std::uint32_t FlightProcess::Impl::find_output(std::uint32_t id) const {
  for (std::uint32_t i = 0; i < ports.size(); ++i) {
    if (ports[i].direction == PortDirection::kOut && ports[i].id == id) return i;
  }
  return UINT32_MAX;
}

std::int32_t FlightProcess::Impl::output(std::uint32_t port, const void* data,
                                         std::uint32_t bytes) {
  if (!calling() || arguments_.call == Call::kDestroy || arguments_.call == Call::kLoad) {
    return ORRERY_REJECTED;
  }
  const std::size_t begin = output_bytes.size();
  const std::uint32_t index = find_output(port);
  if (index == UINT32_MAX) return ORRERY_NOT_FOUND;
  if (bytes > ports[index].max_bytes) return ORRERY_TOO_SMALL;
  {
    const SimulatorScope scope;
    output_bytes.resize(begin + bytes);
  }
  copy_between(output_bytes.data() + begin, data, bytes);
  const SimulatorScope scope;
  outputs.push_back({index, begin, bytes});
  return ORRERY_OK;
}

void FlightProcess::Impl::request_tick(std::int64_t at_ns) {
  if (calling() && arguments_.call != Call::kDestroy) tick_request = at_ns;
}

void FlightProcess::Impl::log(std::int32_t level, const char* line) {
  constexpr std::size_t kMostCharacters = 1000;
  if (!calling()) return;
  const std::size_t length = line == nullptr ? 0 : strnlen(line, kMostCharacters);
  const std::size_t begin = log_text.size();
  {
    const SimulatorScope scope;
    log_text.resize(begin + length);
  }
  copy_between(log_text.data() + begin, line, length);
  const SimulatorScope scope;
  logs.push_back({static_cast<LogLevel>(std::clamp(level, ORRERY_DEBUG + 0, ORRERY_ERROR + 0)),
                  begin, length});
}

std::int32_t FlightProcess::Impl::load_slot(std::uint32_t slot, void* buffer,
                                            std::uint32_t capacity) {
  if (!calling()) return ORRERY_REJECTED;
  const ByteBuffer* content = memory->slot(slot);
  if (options.calls != nullptr) {
    const SimulatorScope scope;
    options.calls->slot_loaded(slot, content);
  }
  if (content == nullptr) return ORRERY_NOT_FOUND;
  if (content->size() > capacity) return ORRERY_TOO_SMALL;
  copy_between(buffer, content->data(), content->size());
  return static_cast<std::int32_t>(content->size());
}

std::int32_t FlightProcess::Impl::store_slot(std::uint32_t slot, const void* data,
                                             std::uint32_t bytes) {
  if (!calling()) return ORRERY_REJECTED;
  if (bytes > options.storage_bytes) return ORRERY_TOO_SMALL;
  {
    const SimulatorScope scope;
    staging_.resize(bytes);
  }
  copy_between(staging_.data(), data, bytes);
  const SimulatorScope scope;
  return memory->store(slot, staging_) ? ORRERY_OK : ORRERY_TOO_SMALL;
}

// The table lies within the process that its context names.
internal::AdaptedProcess internal::adapted_process(const orrery_host* host) {
  return static_cast<FlightProcess::Impl*>(host->context)->adapted();
}

}  // namespace orrery
