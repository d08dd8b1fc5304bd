/// Inside of novatel.cpp: the long part of a CRC-32 by carry-less multiplication.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace orrery::novatel {

constexpr std::size_t kCrcFoldBytes = 64;  // fewer are not worth it

/// The polynomial of `consumed` bytes, made as short as a few registers hold: `remainder`, as if it
/// were the message, has the same CRC when started with 0.
struct CrcFold {
  std::array<std::byte, 16> remainder;
  std::size_t consumed;  // a multiple of 16
};

/// Integers only: the same bits as the tables give.
/// Method  Gopal et al., Fast CRC Computation for Generic Polynomials Using PCLMULQDQ Instruction
///         (Intel, 2009), for the reflected polynomial 0xEDB88320.
/// @param bytes  At least kCrcFoldBytes. @param crc  Of what came before.
CrcFold crc_fold_clmul(Bytes bytes, std::uint32_t crc);

}  // namespace orrery::novatel
