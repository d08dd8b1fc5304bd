#include <orrery/harness/gtest/time_window.hpp>

#include <algorithm>
#include <stdexcept>

namespace orrery {

TimeWindow::TimeWindow(const When& window) {
  const When::Window span = window.window();
  from_ = span.from;
  until_ = span.until;
  const std::string text = window.to_string();
  if (text != "always") text_ = " " + text;
}

TimeWindow operator&&(const TimeWindow& a, const TimeWindow& b) {
  TimeWindow both = a;
  both.from_ = std::max(a.from_, b.from_);
  if (b.until_) both.until_ = std::min(a.until_.value_or(*b.until_), *b.until_);
  both.text_ += (a.text_.empty() || b.text_.empty() ? "" : " and") + b.text_;
  both.waits_in_vain_ = a.waits_in_vain_ || b.waits_in_vain_;
  return both;
}

TimeWindow after(const Channel& event, Duration later) {
  if (later < Duration::zero()) {
    throw std::invalid_argument("after: " + to_string(later) + " after \"" + event.name() +
                                "\"; accepted: 0 s or more");
  }
  TimeWindow window = always();
  window.text_ =
      later == Duration::zero() ? " after \"" : " from " + to_string(later) + " after \"";
  window.text_ += event.name() + "\"";
  if (const auto first = event.first_time()) {
    window.from_ = *first - event.start() + later;
    window.text_ += " at " + to_string(*first - event.start());
  } else {
    window.waits_in_vain_ = true;
    window.text_ += ", which never happened";
  }
  return window;
}

}  // namespace orrery
