#include <orrery/harness/record/json_text.hpp>
#include <orrery/harness/record/number_format.hpp>

#include <algorithm>
#include <cmath>

namespace orrery {
namespace {

bool continues(std::string_view text, std::size_t at) {
  return at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0) == 0x80;
}

// Bytes of the UTF-8 sequence that begins at `at`; 0: none does (RFC 3629: no overlong forms, no
// surrogates, nothing above U+10FFFF).
std::size_t sequence_bytes(std::string_view text, std::size_t at) {
  const auto first = static_cast<unsigned char>(text[at]);
  if (first < 0x80) return 1;
  if (first < 0xC2 || first > 0xF4 || !continues(text, at + 1)) return 0;
  if (first < 0xE0) return 2;
  const auto second = static_cast<unsigned char>(text[at + 1]);
  if ((first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
      (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F)) {
    return 0;
  }
  if (!continues(text, at + 2)) return 0;
  if (first < 0xF0) return 3;
  return continues(text, at + 3) ? 4 : 0;
}

// How many characters of the text's begin stand for themselves: most texts have no others.
std::size_t plain_bytes(std::string_view text) {
  const auto special = [](unsigned char c) {
    return c < ' ' || c >= 0x7f || c == '"' || c == '\\' || c == '<';
  };
  return static_cast<std::size_t>(std::find_if(text.begin(), text.end(), special) - text.begin());
}

void append_escaped(std::string& out, char c) {
  constexpr std::string_view kHex = "0123456789abcdef";
  if (c == '"' || c == '\\') {
    out += '\\';
    out += c;
  } else if (c == '<' || static_cast<unsigned char>(c) < ' ' || c == 0x7f) {
    out += "\\u00";
    out += kHex[static_cast<unsigned char>(c) >> 4];
    out += kHex[static_cast<unsigned char>(c) & 15];
  } else {
    out += c;
  }
}

}  // namespace

void append_json_text(std::string& out, std::string_view text) {
  out += '"';
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t plain = plain_bytes(text.substr(i));
    out += text.substr(i, plain);
    i += plain;
    if (i == text.size()) break;
    const std::size_t bytes = sequence_bytes(text, i);
    if (bytes == 1) {
      append_escaped(out, text[i]);
    } else if (bytes == 0) {
      out += "\\ufffd";
    } else {
      out += text.substr(i, bytes);
    }
    i += bytes == 0 ? 1 : bytes;
  }
  out += '"';
}

void JsonObject::begin(std::string_view name) {
  if (!members_.empty()) members_ += ',';
  append_json_text(members_, name);
  members_ += ':';
}

JsonObject& JsonObject::add(std::string_view name, std::string_view text) {
  begin(name);
  append_json_text(members_, text);
  return *this;
}

JsonObject& JsonObject::add(std::string_view name, double value) {
  begin(name);
  if (std::isfinite(value)) {
    append_number(members_, value);
  } else {
    members_ += "null";
  }
  return *this;
}

JsonObject& JsonObject::add(std::string_view name, std::uint64_t value) {
  begin(name);
  append_number(members_, value);
  return *this;
}

}  // namespace orrery
