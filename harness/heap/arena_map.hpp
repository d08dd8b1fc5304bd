/// A picture of a heap at an instant.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>

#include <string>

namespace orrery {

/// Rows of `columns` characters from the first block to the top, each for the same number of bytes
/// (the least power of two, from 16 on, for which the map has at most `rows` rows): '#' all live,
/// '.' all free, '1' to '9' for the tenths that are live in between. A line above says how many
/// bytes a character stands for.
/// @throws std::invalid_argument  no columns or no rows.
std::string arena_map(const BlockHeap& heap, int columns = 64, int rows = 32);

/// The same as an SVG image of `width_px` by `height_px` in which every block is drawn to scale.
std::string arena_svg(const BlockHeap& heap, int width_px = 1024, int height_px = 256);

}  // namespace orrery
