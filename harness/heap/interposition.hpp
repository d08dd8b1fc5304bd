/// The seam between orrery::allocator, which replaces malloc in a test program, and the harness.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <dirent.h>
#include <optional>
#include <string>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/uio.h>

namespace orrery {

/// What the C library and the loader keep must not lie in the heap of the spacecraft that happened
/// to make them need it: stdout's buffer, time zone, locale, the exception machinery. Once per
/// program, before the first call into flight code; more calls do nothing.
void warm_up_libraries();

/// Self-test of the allocator's hooks: empty, or a message naming those that shared libraries of
/// this program do not reach. Also empty where heaps are not simulated.
std::string verify_interposition();

/// True where time, chance and threads of flight code are answered by us: not under a sanitizer
/// that owns these functions.
bool services_are_virtual();

/// True where files of flight code can be ours: the program links orrery::allocator.
bool files_are_virtual();

namespace internal {

/// The dynamic loader's code. What it allocates (thread-local storage of a library, say) outlives
/// the process in whose call it does so.
extern std::uintptr_t loader_begin, loader_bytes;

/// What flight code must not do to the test program; set once by harness/flight.
struct ProcessHooks {
  /// True: the running process keeps it, and runs it at its own end.
  bool (*register_exit)(void (*function)(void*), void* argument);
  /// Returns if no flight code is running.
  void (*exit)(int status);
  /// A static of a function is about to be initialised: `wanted` may end the call, where a process
  /// crashed within its constructor; `begun` by this thread; `ended`, by an exception too.
  void (*static_wanted)(const void* guard);
  void (*static_begun)(const void* guard);
  void (*static_ended)(const void* guard);
  /// The flight code on this thread's stack, innermost first: number of frames written.
  int (*call_stack)(void** frames, int most);
};
extern const ProcessHooks* process_hooks;

/// What the C library answers flight code; set once by harness/flight. Each gets the name of the
/// function that was called. False: the C library answers.
struct ServiceHooks {
  bool (*read_clock)(const char* function, clockid_t clock, std::int64_t& ns);
  bool (*sleep)(const char* function, std::int64_t ns);
  bool (*sleep_until)(const char* function, clockid_t clock, std::int64_t ns);
  bool (*random_bytes)(const char* function, void* to, std::size_t bytes);
  bool (*random_number)(const char* function, std::int32_t& number);  // 0 ... 2^31 - 1
  bool (*seed)(const char* function, unsigned value);
  bool (*start_thread)(const char* function);
};
extern const ServiceHooks* service_hooks;

/// Files as flight code finds them in place of the host's. A result is that of the system call, or
/// minus errno; without a value it is the host's matter. `function` is what was called, `folder` a
/// descriptor as for openat().
class FileView {
 public:
  using Result = std::optional<long>;
  virtual ~FileView() = default;
  virtual Result open(const char* function, int folder, const char* path, int flags) = 0;
  virtual Result close(int fd) = 0;
  /// All calls that read or write; `offset` kHere is the file's own, which moves on.
  static constexpr std::int64_t kHere = INT64_MIN;
  virtual Result read(int fd, const iovec* to, int parts, std::int64_t offset) = 0;
  virtual Result write(int fd, const iovec* from, int parts, std::int64_t offset) = 0;
  /// sendfile and copy_file_range; an offset that is null is the file's own.
  virtual Result transfer(const char* function, int from, std::int64_t* from_offset, int to,
                          std::int64_t* to_offset, std::size_t bytes) = 0;
  virtual Result seek(int fd, std::int64_t offset, int whence) = 0;
  virtual Result sync(int fd) = 0;
  virtual Result resize(int fd, std::int64_t bytes) = 0;
  virtual Result resize(const char* function, const char* path, std::int64_t bytes) = 0;
  virtual Result allocate(int fd, int mode, std::int64_t offset, std::int64_t bytes) = 0;
  virtual Result space(int fd, struct statvfs* to) = 0;
  virtual Result space(const char* function, const char* path, struct statvfs* to) = 0;
  virtual Result status(int fd, struct stat* to) = 0;
  virtual Result status(const char* function, int folder, const char* path, struct stat* to) = 0;
  virtual Result access(const char* function, int folder, const char* path) = 0;
  enum class Kind : std::uint8_t { kFile, kFolder, kEither };
  virtual Result remove(const char* function, int folder, const char* path, Kind kind) = 0;
  virtual Result rename(const char* function, int from_folder, const char* from, int to_folder,
                        const char* to) = 0;
  virtual Result make_folder(const char* function, int folder, const char* path) = 0;
  /// fopen and fdopen: 0 and the stream, or minus errno.
  virtual Result open_stream(const char* function, const char* path, const char* mode,
                             FILE*& stream) = 0;
  virtual Result open_stream(int fd, const char* mode, FILE*& stream) = 0;
  virtual Result descriptor_of(FILE* stream) = 0;
  /// opendir and fdopendir.
  virtual Result open_folder(const char* function, const char* path, DIR*& folder) = 0;
  virtual Result open_folder(int fd, DIR*& folder) = 0;
  virtual Result read_folder(DIR* folder, dirent*& entry) = 0;  // null: no more
  virtual Result close_folder(DIR* folder) = 0;
  /// dup; the least number is `at_least`.
  virtual Result duplicate(int fd, int at_least, bool closes_at_exec) = 0;
  virtual Result duplicate_to(const char* function, int fd, int to) = 0;
  virtual Result control(int fd, int command, long argument) = 0;  // fcntl
  /// mmap: the address.
  virtual Result map(std::size_t bytes, int protection, int flags, int fd, std::int64_t offset) = 0;
  virtual Result unmap(void* address, std::size_t bytes) = 0;
  /// mkstemp: fills in the six X that stand before the last `suffix` characters.
  virtual Result make_temporary(const char* function, char* name, int suffix, int flags) = 0;
  virtual Result make_temporary_folder(const char* function, char* name, char*& made) = 0;
  virtual Result change_folder(const char* function, const char* path) = 0;
  virtual Result change_folder(const char* function, int fd) = 0;
  /// The length of a path, which is written with its final zero.
  virtual Result current_folder(char* to, std::size_t bytes) = 0;
  virtual Result real_path(const char* path, char* to, std::size_t bytes) = 0;
  /// What can be no file of flight code, whatever its name.
  virtual Result refuse(const char* function) = 0;
};
/// Set once by harness/flight: of the flight code that is running, or null.
using FileViewFunction = FileView*();
extern FileViewFunction* file_view;

}  // namespace internal
}  // namespace orrery
