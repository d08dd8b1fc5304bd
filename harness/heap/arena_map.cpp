#include <orrery/harness/heap/arena_map.hpp>

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace orrery {
namespace {

void check_size(const char* function, int a, int b) {
  if (a > 0 && b > 0) return;
  throw std::invalid_argument(std::string(function) + ": a map of " + std::to_string(a) + " by " +
                              std::to_string(b) + "; both are 1 or more");
}

// Live bytes of each cell.
std::vector<std::uint64_t> live_by_cell(const BlockHeap& heap, std::uint64_t cell_bytes) {
  std::vector<std::uint64_t> live((heap.heap_bytes() + cell_bytes - 1) / cell_bytes, 0);
  heap.visit_blocks([&](const BlockHeap::Block& block) {
    if (!block.live) return;
    const std::uint64_t end = block.begin + block.bytes;
    for (std::uint64_t at = block.begin; at < end;) {
      const std::uint64_t cell = at / cell_bytes;
      const std::uint64_t part = std::min(end, (cell + 1) * cell_bytes) - at;
      live[cell] += part;
      at += part;
    }
  });
  return live;
}

char mark_of(std::uint64_t live, std::uint64_t bytes) {
  if (live == 0) return '.';
  if (live == bytes) return '#';
  return static_cast<char>('0' + std::clamp<std::uint64_t>(live * 10 / bytes, 1, 9));
}

std::string rectangle(std::uint64_t x, std::uint64_t y, std::uint64_t width, std::uint64_t height,
                      const char* colour) {
  return "<rect x=\"" + std::to_string(x) + "\" y=\"" + std::to_string(y) + "\" width=\"" +
         std::to_string(width) + "\" height=\"" + std::to_string(height) + "\" fill=\"" + colour +
         "\"/>\n";
}

}  // namespace

std::string arena_map(const BlockHeap& heap, int columns, int rows) {
  check_size("arena_map", columns, rows);
  const std::uint64_t width = static_cast<std::uint64_t>(columns);
  const std::uint64_t cells = width * static_cast<std::uint64_t>(rows);
  std::uint64_t cell_bytes = 16;
  while (cell_bytes * cells < heap.heap_bytes()) cell_bytes *= 2;

  std::string map = std::to_string(cell_bytes) + " bytes per character, " +
                    std::to_string(heap.heap_bytes()) + " in all\n";
  const std::vector<std::uint64_t> live = live_by_cell(heap, cell_bytes);
  for (std::uint64_t i = 0; i < live.size(); ++i) {
    map += mark_of(live[i], std::min(cell_bytes, heap.heap_bytes() - i * cell_bytes));
    if (i % width + 1 == width || i + 1 == live.size()) map += '\n';
  }
  return map;
}

// Rows of 8 pixels, in units of a pixel's share of the heap; a block may be wrapped over rows.
std::string arena_svg(const BlockHeap& heap, int width_px, int height_px) {
  check_size("arena_svg", width_px, height_px);
  constexpr std::uint64_t kRow_px = 8;
  const std::uint64_t rows =
      std::max<std::uint64_t>(static_cast<std::uint64_t>(height_px) / kRow_px, 1);
  // User units along a row are bytes, so that every block is to scale.
  const std::uint64_t row_bytes = std::max<std::uint64_t>((heap.heap_bytes() + rows - 1) / rows, 1);
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + std::to_string(width_px) +
      "\" height=\"" + std::to_string(rows * kRow_px) + "\" viewBox=\"0 0 " +
      std::to_string(row_bytes) + " " + std::to_string(rows * kRow_px) +
      "\" preserveAspectRatio=\"none\" shape-rendering=\"crispEdges\">\n<title>heap of " +
      std::to_string(heap.heap_bytes()) + " bytes, " + std::to_string(heap.live_bytes()) +
      " live</title>\n";
  heap.visit_blocks([&](const BlockHeap::Block& block) {
    const std::uint64_t end = block.begin + block.bytes;
    for (std::uint64_t at = block.begin; at < end;) {
      const std::uint64_t row = at / row_bytes;
      const std::uint64_t part = std::min(end, (row + 1) * row_bytes) - at;
      svg += rectangle(at % row_bytes, row * kRow_px, part, kRow_px - 1,
                       block.live ? "#1f5fa8" : "#dddddd");
      at += part;
    }
  });
  return svg + "</svg>\n";
}

}  // namespace orrery
