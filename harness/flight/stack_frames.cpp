#include <orrery/harness/flight/elf_image.hpp>
#include <orrery/harness/flight/library_closure.hpp>
#include <orrery/harness/flight/stack_frames.hpp>

#include <algorithm>
#include <cstdlib>
#include <cxxabi.h>
#include <dlfcn.h>
#include <map>
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

// Read when a frame lies in them, and then once.
class Images {
 public:
  explicit Images(const std::vector<std::string>& paths) : paths_(paths) {}

  /// Null: not one of ours, or unreadable; then the report does without names.
  const ElfImage* of(const std::string& path) {
    if (std::find(paths_.begin(), paths_.end(), path) == paths_.end()) return nullptr;
    auto known = images_.find(path);
    if (known == images_.end()) {
      std::optional<ElfImage> image;
      try {
        image.emplace(read_file(path));
      } catch (const std::exception&) {
      }
      known = images_.emplace(path, std::move(image)).first;
    }
    return known->second ? &*known->second : nullptr;
  }

 private:
  const std::vector<std::string>& paths_;
  std::map<std::string, std::optional<ElfImage>> images_;
};

std::uintptr_t base_of(const void* address) {
  Dl_info info{};
  return dladdr(address, &info) != 0 ? reinterpret_cast<std::uintptr_t>(info.dli_fbase) : 0;
}

StackFrame frame_of(const void* address, bool is_return_address, Images& images) {
  StackFrame frame;
  frame.address = reinterpret_cast<std::uintptr_t>(address);
  Dl_info info{};
  if (dladdr(address, &info) == 0) return frame;
  frame.object = info.dli_fname;
  frame.offset = frame.address - reinterpret_cast<std::uintptr_t>(info.dli_fbase);
  if (const ElfImage* image = images.of(frame.object)) {
    // A return address is behind its call, which may be the last instruction of its function.
    frame.function = readable(image->function_at(frame.offset - (is_return_address ? 1 : 0)));
  } else if (info.dli_sname != nullptr) {
    frame.function = readable(info.dli_sname);
  }
  return frame;
}

}  // namespace

std::vector<StackFrame> stack_frames(const CrashCapture& capture,
                                     const std::vector<std::string>& libraries) {
  if (capture.frame_count == 0) return {};
  const std::uintptr_t harness = base_of(reinterpret_cast<const void*>(&stack_frames));
  int begin = 0, end = capture.frame_count;
  while (end > 0 && base_of(capture.frames[end - 1]) == harness) --end;
  // malloc and its kin are ours, and so is what they call; a signal's stack begins at its cause.
  while (capture.signal == 0 && begin < end && base_of(capture.frames[begin]) == harness) ++begin;
  Images images(libraries);
  std::vector<StackFrame> frames;
  for (int i = begin; i < end; ++i) {
    const bool is_return_address = i > 0 || capture.signal == 0;
    frames.push_back(frame_of(capture.frames[i], is_return_address, images));
  }
  return frames;
}

}  // namespace orrery::internal
