/// The files of one spacecraft: a small tree in memory, which outlives the processes that use it.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// Paths are absolute, with "/" between names and neither "." nor ".." in them: normal() makes them
/// so. What a function cannot do it says as the system calls do, by a negative errno.
///
/// Covers   The folders that hold the given files, and all below them. Elsewhere there is nothing.
/// Folders  Making, renaming and removing is done at once and for good; only content waits for
///          sync().
class FlightFiles {
 public:
  struct Node {
    bool is_folder = false;
    std::uint64_t number = 0;  // as an inode has
    std::int64_t changed_unix_ns = 0;
    ByteBuffer content = {};
    ByteBuffer synced = {};  // what a loss of power leaves, where that is asked for
  };
  using NodePointer = std::shared_ptr<Node>;

  /// @param files  Path -> content. A path that ends in "/" is an empty folder.
  /// @param capacity_bytes  Of all content together.
  /// @param loses_unsynced  lose_power() takes what was written since the last sync().
  /// @throws std::invalid_argument  a path is empty, is both a file and a folder, or the files
  ///                                exceed the capacity.
  FlightFiles(const std::map<std::string, std::string>& files, std::uint64_t capacity_bytes,
              bool loses_unsynced);

  /// `path` seen from the folder `from`.
  static std::string normal(std::string_view from, std::string_view path);

  bool covers(std::string_view path) const;
  NodePointer find(const std::string& path) const;  // null: no such file
  /// An empty one. -EEXIST, -ENOENT (no folder to put it in), -ENOTDIR.
  int make(const std::string& path, bool is_folder, std::int64_t unix_ns);
  /// -ENOENT; -EISDIR, -ENOTDIR, -ENOTEMPTY, as for unlink and rmdir. Who has it open keeps it.
  int remove(const std::string& path, bool is_folder);
  /// Takes the place of a file that is there. -ENOENT, -ENOTDIR, -EISDIR, -ENOTEMPTY, -EINVAL.
  int rename(const std::string& from, const std::string& to);
  /// Of what lies in a folder, in order.
  std::vector<std::string> names_in(const std::string& folder) const;
  std::vector<std::string> paths() const;  // of all files, without folders

  /// Bytes from `at` on; what lies between the end and `at` is 0. -ENOSPC, and then nothing.
  int write(Node& node, std::uint64_t at, Bytes bytes, std::int64_t unix_ns);
  int resize(Node& node, std::uint64_t bytes, std::int64_t unix_ns);
  void sync(Node& node);
  void lose_power();

  std::uint64_t used_bytes(const Node* without = nullptr) const;
  std::uint64_t capacity_bytes() const { return capacity_bytes_; }

 private:
  int check_parent(const std::string& path) const;
  bool has_room(const Node& node, std::uint64_t bytes) const;

  std::map<std::string, NodePointer> nodes_;  // by path
  std::vector<std::string> covered_;          // folders
  std::uint64_t capacity_bytes_;
  bool loses_unsynced_;
  std::uint64_t next_number_ = 1;
};

}  // namespace orrery
