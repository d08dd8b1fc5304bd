#include <orrery/harness/record/series_envelope.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

void absorb(SeriesEnvelope::Span& into, const SeriesEnvelope::Span& next) {
  into.end = next.end;
  into.least = std::min(into.least, next.least);
  into.most = std::max(into.most, next.most);
  into.last = next.last;
}

}  // namespace

SeriesEnvelope::SeriesEnvelope(std::size_t most) : most_(most) {
  if (most >= 2) return;
  throw std::invalid_argument("SeriesEnvelope: most = " + std::to_string(most) +
                              "; accepted: 2 or more");
}

void SeriesEnvelope::add(Duration t, double value) {
  if (std::isnan(value)) return;
  const Span sample{t, t, value, value, value};
  if (!spans_.empty() && t < cell_end_) {
    absorb(spans_.back(), sample);
    return;
  }
  spans_.push_back(sample);
  while (spans_.size() > most_) halve();
  find_cell_end();
}

// Of times with the same quotient, rounded towards zero.
void SeriesEnvelope::find_cell_end() {
  const auto cell = spans_.back().begin / length_;
  cell_end_ = cell >= 0 ? (cell + 1) * length_ : cell * length_ + Duration{1};
}

// Twice the length; spans that now fall together become one.
void SeriesEnvelope::halve() {
  length_ *= 2;
  std::vector<Span> merged;
  merged.reserve(spans_.size());
  for (const Span& span : spans_) {
    if (!merged.empty() && merged.back().begin / length_ == span.begin / length_) {
      absorb(merged.back(), span);
    } else {
      merged.push_back(span);
    }
  }
  spans_ = std::move(merged);
}

}  // namespace orrery
