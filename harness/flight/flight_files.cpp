#include <orrery/harness/flight/flight_files.hpp>

#include <algorithm>
#include <cerrno>
#include <stdexcept>

namespace orrery {
namespace {

std::string parent_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == 0 || slash == std::string::npos ? "/" : path.substr(0, slash);
}

bool lies_in(std::string_view path, std::string_view folder) {
  if (folder == "/" || path == folder) return true;
  return path.size() > folder.size() && path.substr(0, folder.size()) == folder &&
         path[folder.size()] == '/';
}

}  // namespace

FlightFiles::FlightFiles(const std::map<std::string, std::string>& files,
                         std::uint64_t capacity_bytes, bool loses_unsynced)
    : capacity_bytes_(capacity_bytes), loses_unsynced_(loses_unsynced) {
  for (const auto& [given, content] : files) {
    const bool is_folder = !given.empty() && given.back() == '/';
    const std::string path = normal("/", given);
    const auto refuse = [&name = given](const std::string& why) {
      throw std::invalid_argument("FlightOptions::files: \"" + name + "\" " + why);
    };
    if (given.empty() || (path == "/" && !is_folder)) refuse("names no file");
    if (is_folder && !content.empty()) refuse("is a folder, so it has no content");
    const std::string folder = is_folder ? path : parent_of(path);
    for (std::string at = folder;; at = parent_of(at)) {
      const NodePointer there = find(at);
      if (there != nullptr && !there->is_folder) refuse("lies in a file, " + at);
      if (there == nullptr) {
        nodes_[at] = std::make_shared<Node>(Node{.is_folder = true, .number = next_number_++});
      }
      if (at == "/") break;
    }
    covered_.push_back(folder);
    if (is_folder) continue;
    if (find(path) != nullptr) refuse("is given twice, or is a folder as well");
    const NodePointer node = std::make_shared<Node>(Node{.number = next_number_++});
    const auto* bytes = reinterpret_cast<const std::byte*>(content.data());
    node->content.assign(bytes, bytes + content.size());
    sync(*node);
    nodes_[path] = node;
  }
  if (used_bytes() > capacity_bytes) {
    throw std::invalid_argument("FlightOptions::files: " + std::to_string(used_bytes()) +
                                " bytes; file_bytes allows " + std::to_string(capacity_bytes));
  }
}

std::string FlightFiles::normal(std::string_view from, std::string_view path) {
  std::vector<std::string_view> names;
  const auto add = [&names](std::string_view part) {
    while (!part.empty()) {
      const std::size_t end = std::min(part.find('/'), part.size());
      const std::string_view name = part.substr(0, end);
      if (name == "..") {
        if (!names.empty()) names.pop_back();
      } else if (!name.empty() && name != ".") {
        names.push_back(name);
      }
      part.remove_prefix(std::min(end + 1, part.size()));
    }
  };
  if (path.empty() || path[0] != '/') add(from);
  add(path);
  std::string result;
  for (const std::string_view name : names) result.append("/").append(name);
  return result.empty() ? "/" : result;
}

bool FlightFiles::covers(std::string_view path) const {
  return std::any_of(covered_.begin(), covered_.end(),
                     [path](const std::string& folder) { return lies_in(path, folder); });
}

FlightFiles::NodePointer FlightFiles::find(const std::string& path) const {
  const auto found = nodes_.find(path);
  return found == nodes_.end() ? nullptr : found->second;
}

int FlightFiles::check_parent(const std::string& path) const {
  const NodePointer parent = find(parent_of(path));
  if (parent == nullptr) return -ENOENT;
  return parent->is_folder ? 0 : -ENOTDIR;
}

int FlightFiles::make(const std::string& path, bool is_folder, std::int64_t unix_ns) {
  if (find(path) != nullptr) return -EEXIST;
  if (const int error = check_parent(path)) return error;
  nodes_[path] = std::make_shared<Node>(
      Node{.is_folder = is_folder, .number = next_number_++, .changed_unix_ns = unix_ns});
  return 0;
}

int FlightFiles::remove(const std::string& path, bool is_folder) {
  const NodePointer node = find(path);
  if (node == nullptr) return -ENOENT;
  if (node->is_folder != is_folder) return is_folder ? -ENOTDIR : -EISDIR;
  if (is_folder && (path == "/" || !names_in(path).empty())) return -ENOTEMPTY;
  nodes_.erase(path);
  return 0;
}

int FlightFiles::rename(const std::string& from, const std::string& to) {
  const NodePointer node = find(from);
  if (node == nullptr) return -ENOENT;
  if (const int error = check_parent(to)) return error;
  if (from == to) return 0;
  if (from == "/" || lies_in(to, from)) return -EINVAL;
  if (const NodePointer there = find(to)) {
    if (there->is_folder != node->is_folder) return there->is_folder ? -EISDIR : -ENOTDIR;
    if (there->is_folder && !names_in(to).empty()) return -ENOTEMPTY;
  }
  std::vector<std::pair<std::string, NodePointer>> moved;
  for (const auto& [path, one] : nodes_) {
    if (lies_in(path, from)) moved.emplace_back(path, one);
  }
  for (const auto& [path, one] : moved) nodes_.erase(path);
  for (const auto& [path, one] : moved) nodes_[to + path.substr(from.size())] = one;
  return 0;
}

std::vector<std::string> FlightFiles::names_in(const std::string& folder) const {
  const std::string prefix = folder == "/" ? folder : folder + "/";
  std::vector<std::string> names;
  for (auto node = nodes_.upper_bound(prefix); node != nodes_.end(); ++node) {
    if (node->first.compare(0, prefix.size(), prefix) != 0) break;
    const std::string name = node->first.substr(prefix.size());
    if (name.find('/') == std::string::npos) names.push_back(name);
  }
  return names;
}

std::vector<std::string> FlightFiles::paths() const {
  std::vector<std::string> paths;
  for (const auto& [path, node] : nodes_) {
    if (!node->is_folder) paths.push_back(path);
  }
  return paths;
}

// Files that were removed while somebody has them open do not count.
std::uint64_t FlightFiles::used_bytes(const Node* without) const {
  std::uint64_t bytes = 0;
  for (const auto& [path, node] : nodes_) bytes += node.get() == without ? 0 : node->content.size();
  return bytes;
}

bool FlightFiles::has_room(const Node& node, std::uint64_t bytes) const {
  if (bytes <= node.content.size()) return true;
  return bytes <= capacity_bytes_ && used_bytes(&node) <= capacity_bytes_ - bytes;
}

int FlightFiles::write(Node& node, std::uint64_t at, Bytes bytes, std::int64_t unix_ns) {
  if (bytes.empty()) return 0;
  if (at > capacity_bytes_ || !has_room(node, at + bytes.size())) return -ENOSPC;
  if (at + bytes.size() > node.content.size()) node.content.resize(at + bytes.size());
  std::copy(bytes.begin(), bytes.end(), node.content.begin() + static_cast<std::ptrdiff_t>(at));
  node.changed_unix_ns = unix_ns;
  return 0;
}

int FlightFiles::resize(Node& node, std::uint64_t bytes, std::int64_t unix_ns) {
  if (!has_room(node, bytes)) return -ENOSPC;
  node.content.resize(bytes);
  node.changed_unix_ns = unix_ns;
  return 0;
}

void FlightFiles::sync(Node& node) {
  if (loses_unsynced_) node.synced = node.content;
}

void FlightFiles::lose_power() {
  if (!loses_unsynced_) return;
  for (const auto& [path, node] : nodes_) node->content = node->synced;
}

}  // namespace orrery
