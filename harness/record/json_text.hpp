/// JSON written as the run goes: texts that any bytes make valid, objects without a library.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace orrery {

/// Appends `text` in quotes. '<' is escaped, so that no text ends the script of a page; what is not
/// UTF-8 becomes U+FFFD, since flight software logs what it likes.
void append_json_text(std::string& out, std::string_view text);

/// An object, member by member, in the order of the calls: JsonObject().add("bytes", 96).text().
class JsonObject {
 public:
  JsonObject& add(std::string_view name, std::string_view text);
  JsonObject& add(std::string_view name, const char* text) {
    return add(name, std::string_view(text));
  }
  /// Not finite: null.
  JsonObject& add(std::string_view name, double value);
  JsonObject& add(std::string_view name, std::uint64_t value);
  bool empty() const { return members_.empty(); }
  /// Its members without the braces.
  const std::string& members() const { return members_; }
  std::string text() const { return "{" + members_ + "}"; }

 private:
  void begin(std::string_view name);
  std::string members_;
};

}  // namespace orrery
