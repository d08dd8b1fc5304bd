#include <orrery/models/camera/png.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

namespace orrery {

namespace {

constexpr std::size_t kLargestBlock = 65535, kMostColours = 256;

void put_u32(ByteBuffer& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) {
    out.push_back(static_cast<std::byte>((value >> shift) & 0xFF));
  }
}

// CRC-32 of ISO 3309, as PNG (2nd ed., annex D) has it: of all bytes, one at a time.
constexpr std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t b = 0; b < 256; ++b) {
    std::uint32_t crc = b;
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320u : 0u);
    table[b] = crc;
  }
  return table;
}
constexpr std::array<std::uint32_t, 256> kCrcOfByte = crc_table();

std::uint32_t crc32(Bytes bytes) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const std::byte b : bytes) {
    crc = (crc >> 8) ^ kCrcOfByte[(crc ^ static_cast<std::uint32_t>(b)) & 0xFF];
  }
  return ~crc;
}

std::uint32_t adler32(Bytes bytes) {
  std::uint32_t a = 1, b = 0;
  for (const std::byte byte : bytes) {
    a = (a + static_cast<std::uint32_t>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  return (b << 16) | a;
}

void put_chunk(ByteBuffer& out, std::string_view type, Bytes content) {
  put_u32(out, static_cast<std::uint32_t>(content.size()));
  const std::size_t begin = out.size();
  for (const char c : type) out.push_back(static_cast<std::byte>(c));
  out.insert(out.end(), content.begin(), content.end());
  put_u32(out, crc32(Bytes(out).subspan(begin)));
}

// RFC 1950 and 1951: stored blocks.
ByteBuffer zlib_stream(Bytes content) {
  ByteBuffer out{std::byte{0x78}, std::byte{0x01}};
  for (std::size_t at = 0; at < content.size(); at += kLargestBlock) {
    const std::size_t count = std::min(kLargestBlock, content.size() - at);
    out.push_back(std::byte{at + count == content.size()});
    for (const std::size_t value : {count, ~count}) {
      out.push_back(static_cast<std::byte>(value & 0xFF));
      out.push_back(static_cast<std::byte>((value >> 8) & 0xFF));
    }
    const Bytes block = content.subspan(at, count);
    out.insert(out.end(), block.begin(), block.end());
  }
  put_u32(out, adler32(content));
  return out;
}

enum ColourType { kGrey = 0, kRgb = 2, kIndexed = 3 };
struct Format {
  int bit_depth;
  ColourType colour_type;
  std::string_view chunk;  // that comes before the pixels, if it has content
  ByteBuffer content;
};

// `rows`: each with its filter type 0 in front.
ByteBuffer png(int width, int height, const Format& format, Bytes rows) {
  ByteBuffer out;
  for (const int b : {0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A}) out.push_back(std::byte(b));
  ByteBuffer header;
  put_u32(header, static_cast<std::uint32_t>(width));
  put_u32(header, static_cast<std::uint32_t>(height));
  for (const int b : {format.bit_depth, static_cast<int>(format.colour_type), 0, 0, 0})
    header.push_back(std::byte(b));
  put_chunk(out, "IHDR", header);
  if (!format.content.empty()) put_chunk(out, format.chunk, format.content);
  put_chunk(out, "IDAT", zlib_stream(rows));
  put_chunk(out, "IEND", {});
  return out;
}

void check(int width, int height) {
  if (width < 1 || height < 1) {
    throw std::invalid_argument("to_png: an image of " + std::to_string(width) + " x " +
                                std::to_string(height) + " px; accepted: 1 or more");
  }
}

}  // namespace

ByteBuffer to_png(const DigitalImage& image, int bits) {
  check(image.width_px, image.height_px);
  if (bits < 1 || bits > 16) {
    throw std::invalid_argument("to_png: bits = " + std::to_string(bits) + "; accepted: 1 to 16");
  }
  ByteBuffer rows;
  rows.reserve(2 * image.values.size() + static_cast<std::size_t>(image.height_px));
  for (int v = 0; v < image.height_px; ++v) {
    rows.push_back(std::byte{0});
    for (int u = 0; u < image.width_px; ++u) {
      const unsigned value = static_cast<unsigned>(image.at(u, v)) << (16 - bits);
      rows.push_back(static_cast<std::byte>((value >> 8) & 0xFF));
      rows.push_back(static_cast<std::byte>(value & 0xFF));
    }
  }
  return png(image.width_px, image.height_px, {16, kGrey, "sBIT", {static_cast<std::byte>(bits)}},
             rows);
}

ByteBuffer to_png(const Image<Rgb>& image) {
  check(image.width_px, image.height_px);
  std::map<Rgb, std::size_t> colours;
  for (const Rgb& colour : image.values) {
    colours.emplace(colour, colours.size());
    if (colours.size() > kMostColours) break;
  }
  const bool is_indexed = colours.size() <= kMostColours;
  ByteBuffer rows, palette;
  for (int v = 0; v < image.height_px; ++v) {
    rows.push_back(std::byte{0});
    for (int u = 0; u < image.width_px; ++u) {
      const Rgb& colour = image.at(u, v);
      if (is_indexed) {
        rows.push_back(static_cast<std::byte>(colours.at(colour)));
      } else {
        for (const std::uint8_t part : colour) rows.push_back(std::byte{part});
      }
    }
  }
  if (!is_indexed) return png(image.width_px, image.height_px, {8, kRgb, {}, {}}, rows);
  palette.resize(3 * colours.size());
  for (const auto& [colour, index] : colours) {
    for (std::size_t k = 0; k < 3; ++k) palette[3 * index + k] = std::byte{colour[k]};
  }
  return png(image.width_px, image.height_px, {8, kIndexed, "PLTE", palette}, rows);
}

}  // namespace orrery
