/// The star catalogue as a file on board.
///
/// Format      A line per star: right ascension [deg], declination [deg], V, with blanks between;
///             `#` starts a comment, empty lines are passed over. Equator and equinox of J2000,
///             proper motion applied to the time of the mission. Lines of up to 127 characters.
#pragma once

#include <cstddef>
#include <vector>

#include "rpo_kit/imaging/star_catalogue.hpp"

namespace rpo_kit {

/// @param stars    Appended to; null: the file is checked only.
/// @param message  Gets one line that says what is wrong, and where.
/// @return false: no such file, a line that is none, or fewer than four stars.
bool load_stars(const char* path, std::vector<Star>* stars, char* message,
                std::size_t message_bytes);

}  // namespace rpo_kit
