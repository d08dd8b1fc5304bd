/// Open files of one flight process: what open, read, fopen and their kin do for it.
#pragma once

#include <orrery/harness/flight/flight_options.hpp>
#include <orrery/harness/flight/non_volatile_memory.hpp>
#include <orrery/harness/flight/virtual_services.hpp>
#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>

#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace orrery::internal {

// To print where an error was, a sanitizer opens files from within flight code.
#ifdef ORRERY_ADDRESS_SANITIZER
inline constexpr bool kCanRefuse = false;
#else
inline constexpr bool kCanRefuse = true;
#endif

/// Of one life of a process.
///
/// Numbers   Descriptors are 512 to 1023, the lowest free one first, so that none is the host's;
///           these go to the C library, and neither takes the place of the other. Paths are seen
///           from "/", until chdir.
/// Streams   A FILE and its buffer are the C library's, on no simulated heap. What a stream had not
///           written when its process crashed is lost with it.
/// Mappings  MAP_PRIVATE only: a copy of what the file holds at the call, in memory that is no heap
///           and goes with the process.
/// Locks     of fcntl, flock and lockf are granted: nobody else has these files.
/// Calls     All functions of FileView are called as flight code, and by nobody else.
class FileServices final : public FileView {
 public:
  FileServices(const FlightProcessOptions& options, std::shared_ptr<NonVolatileMemory> memory,
               const VirtualServices& clock);
  ~FileServices() override;

  /// Orderly end, as flight code: what streams hold is written, as exit() does.
  void flush();
  /// The end, as simulator code: everything is closed, nothing written.
  void close_all();

  Result open(const char* function, int folder, const char* path, int flags) override;
  Result close(int fd) override;
  Result read(int fd, const iovec* to, int parts, std::int64_t offset) override;
  Result write(int fd, const iovec* from, int parts, std::int64_t offset) override;
  Result transfer(const char* function, int from, std::int64_t* from_offset, int to,
                  std::int64_t* to_offset, std::size_t bytes) override;
  Result seek(int fd, std::int64_t offset, int whence) override;
  Result sync(int fd) override;
  Result resize(int fd, std::int64_t bytes) override;
  Result resize(const char* function, const char* path, std::int64_t bytes) override;
  Result allocate(int fd, int mode, std::int64_t offset, std::int64_t bytes) override;
  Result space(int fd, struct statvfs* to) override;
  Result space(const char* function, const char* path, struct statvfs* to) override;
  Result status(int fd, struct stat* to) override;
  Result status(const char* function, int folder, const char* path, struct stat* to) override;
  Result access(const char* function, int folder, const char* path) override;
  Result remove(const char* function, int folder, const char* path, Kind kind) override;
  Result rename(const char* function, int from_folder, const char* from, int to_folder,
                const char* to) override;
  Result make_folder(const char* function, int folder, const char* path) override;
  Result open_stream(const char* function, const char* path, const char* mode,
                     FILE*& stream) override;
  Result open_stream(int fd, const char* mode, FILE*& stream) override;
  Result descriptor_of(FILE* stream) override;
  Result open_folder(const char* function, const char* path, DIR*& folder) override;
  Result open_folder(int fd, DIR*& folder) override;
  Result read_folder(DIR* folder, dirent*& entry) override;
  Result close_folder(DIR* folder) override;
  Result duplicate(int fd, int at_least, bool closes_at_exec) override;
  Result duplicate_to(const char* function, int fd, int to) override;
  Result control(int fd, int command, long argument) override;
  Result map(std::size_t bytes, int protection, int flags, int fd, std::int64_t offset) override;
  Result unmap(void* address, std::size_t bytes) override;
  Result make_temporary(const char* function, char* name, int suffix, int flags) override;
  Result make_temporary_folder(const char* function, char* name, char*& made) override;
  Result change_folder(const char* function, const char* path) override;
  Result change_folder(const char* function, int fd) override;
  Result current_folder(char* to, std::size_t bytes) override;
  Result real_path(const char* path, char* to, std::size_t bytes) override;
  Result refuse(const char* function) override;

 private:
  struct Stream;
  struct OpenFile {
    FlightFiles::NodePointer node = nullptr;
    std::string path = {};
    int flags = 0;
    std::uint64_t offset = 0;
    // Of a folder.
    std::vector<std::string> names = {};
    std::size_t next_name = 0;
    dirent entry = {};

    bool readable() const;
    bool writable() const;
  };
  struct Descriptor {
    std::shared_ptr<OpenFile> file;  // one for all copies of a descriptor
    std::shared_ptr<Stream> stream = nullptr;
    int flags = 0;
  };
  static constexpr int kFirst = 512, kEnd = 1024;  // descriptors
  struct Mapping {
    std::byte* begin;
    std::size_t bytes;  // in whole pages
  };
  enum class Place : std::uint8_t { kOurs, kHost, kAbsent, kRefused };

  Place place_of(int folder, const char* text, std::string& path) const;
  /// action(path), as simulator code, where the path is the spacecraft's.
  template <class Action>
  Result at_path(const char* function, int folder, const char* path, Action action) {
    return do_at_path(function, folder, path, &action, [](void* a, const std::string& full) {
      return static_cast<long>((*static_cast<Action*>(a))(full));
    });
  }
  Result do_at_path(const char* function, int folder, const char* path, void* action,
                    long (*call)(void* action, const std::string& full));
  template <class Make>
  Result at_free_name(const char* function, char* name, int suffix, Make make);
  static long end_call(const char* refusal);
  int free_number(int at_least) const;
  long open_node(const std::string& path, int flags);
  long describe(const FlightFiles::Node& node, struct stat* to) const;
  long write_staged(OpenFile& file, std::uint64_t at);
  static long refuse_between(const char* function, int first, int second);
  struct statvfs describe_medium();
  long make_stream(int fd, const char* mode, FILE*& stream);
  void orphan(std::shared_ptr<Stream> stream);
  OpenFile* find(int fd);
  OpenFile* find_folder(DIR* folder, int* fd = nullptr);
  FlightFiles& files() { return memory_->files; }

  const FlightProcessOptions& options_;
  std::shared_ptr<NonVolatileMemory> memory_;
  const VirtualServices& clock_;
  std::map<int, Descriptor> open_;
  std::vector<Mapping> mappings_;
  std::string folder_ = "/";                      // the working folder
  std::vector<std::shared_ptr<Stream>> orphans_;  // their descriptors were closed under them
  ByteBuffer staging_;  // what is written: a copy, for reading it may fault
};

/// Makes the interposed functions of this program (file_hooks.cpp of harness/heap) come here.
void install_file_view();

}  // namespace orrery::internal
