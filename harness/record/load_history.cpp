#include <orrery/harness/record/load_history.hpp>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace orrery {

LoadHistory::LoadHistory(std::size_t most) : most_(most) {
  if (most >= 2) return;
  throw std::invalid_argument("LoadHistory: most = " + std::to_string(most) +
                              "; accepted: 2 or more");
}

void LoadHistory::add(Duration begin, Duration end) {
  keep(last_begin_, last_end_);
  last_begin_ = begin;
  last_end_ = std::max(begin, end);
}

void LoadHistory::cut(Duration t) {
  last_end_ = std::max(last_begin_, std::min(last_end_, t));
}

void LoadHistory::keep(Duration begin, Duration end) {
  total_ += end - begin;
  while (begin < end) {
    while (begin / cell_ >= static_cast<std::int64_t>(most_)) halve();
    const auto cell = static_cast<std::size_t>(begin / cell_);
    if (busy_.size() <= cell) busy_.resize(cell + 1);
    const Duration until = std::min(end, cell_ * static_cast<std::int64_t>(cell + 1));
    busy_[cell] += until - begin;
    begin = until;
  }
}

void LoadHistory::halve() {
  cell_ *= 2;
  for (std::size_t i = 0; 2 * i < busy_.size(); ++i) {
    const Duration odd = 2 * i + 1 < busy_.size() ? busy_[2 * i + 1] : Duration::zero();
    busy_[i] = busy_[2 * i] + odd;
  }
  busy_.resize((busy_.size() + 1) / 2);
}

SeriesEnvelope LoadHistory::percent(Duration length) const {
  LoadHistory all = *this;
  all.add(last_end_, last_end_);
  SeriesEnvelope values(2 * most_);
  double last = 0;
  Duration begin{};
  for (; begin < length; begin += all.cell_) {
    const auto cell = static_cast<std::size_t>(begin / all.cell_);
    const Duration busy = cell < all.busy_.size() ? all.busy_[cell] : Duration::zero();
    const Duration span = std::min(all.cell_, length - begin);
    // A call that outlasts the run counts as far as the run goes.
    last = 100 * to_seconds(std::min(busy, span)) / to_seconds(span);
    values.add(begin, last);
  }
  if (begin > Duration::zero()) values.add(length, last);
  return values;
}

}  // namespace orrery
