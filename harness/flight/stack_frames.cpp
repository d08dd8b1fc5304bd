#include <orrery/harness/flight/elf_image.hpp>
#include <orrery/harness/flight/stack_frames.hpp>

#include <cstdlib>
#include <cxxabi.h>
#include <dlfcn.h>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>

namespace orrery::internal {
namespace {

std::string readable(const std::string& symbol) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> text(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), std::free);
  return status == 0 ? text.get() : symbol;
}

std::optional<ElfImage> image_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string content{std::istreambuf_iterator<char>(file), {}};
  ByteBuffer bytes(content.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(content[i]);
  try {
    return ElfImage(std::move(bytes));
  } catch (const std::exception&) {
    return std::nullopt;  // the report does without names
  }
}

std::uintptr_t base_of(const void* address) {
  Dl_info info{};
  return dladdr(address, &info) != 0 ? reinterpret_cast<std::uintptr_t>(info.dli_fbase) : 0;
}

StackFrame frame_of(const void* address, bool is_return_address, const std::string& library,
                    const std::optional<ElfImage>& image) {
  StackFrame frame;
  frame.address = reinterpret_cast<std::uintptr_t>(address);
  Dl_info info{};
  if (dladdr(address, &info) == 0) return frame;
  frame.object = info.dli_fname;
  frame.offset = frame.address - reinterpret_cast<std::uintptr_t>(info.dli_fbase);
  if (frame.object == library && image) {
    // A return address is behind its call, which may be the last instruction of its function.
    frame.function = readable(image->function_at(frame.offset - (is_return_address ? 1 : 0)));
  } else if (info.dli_sname != nullptr) {
    frame.function = readable(info.dli_sname);
  }
  return frame;
}

}  // namespace

std::vector<StackFrame> stack_frames(const CrashCapture& capture, const std::string& library) {
  if (capture.frame_count == 0) return {};
  const std::uintptr_t harness = base_of(reinterpret_cast<const void*>(&stack_frames));
  int begin = 0, end = capture.frame_count;
  while (end > 0 && base_of(capture.frames[end - 1]) == harness) --end;
  // malloc and its kin are ours, and so is what they call; a signal's stack begins at its cause.
  while (capture.signal == 0 && begin < end && base_of(capture.frames[begin]) == harness) ++begin;
  const std::optional<ElfImage> image = image_of(library);
  std::vector<StackFrame> frames;
  for (int i = begin; i < end; ++i) {
    const bool is_return_address = i > 0 || capture.signal == 0;
    frames.push_back(frame_of(capture.frames[i], is_return_address, library, image));
  }
  return frames;
}

}  // namespace orrery::internal
