#include <orrery/harness/flight/execution_time.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kLongest_ns = 365.25 * 86400e9;

void require_not_negative(const char* what, Duration value) {
  if (value < Duration{0}) {
    throw std::invalid_argument(std::string("ExecutionTime: ") + what + " = " + to_string(value) +
                                "; it is 0 or more");
  }
}

void require_not_negative(const char* what, double value) {
  if (!(value >= 0 && std::isfinite(value))) {
    throw std::invalid_argument(std::string("ExecutionTime: ") + what + " = " + to_text(value) +
                                "; it is 0 or more, and finite");
  }
}

Duration rounded(double ns) {
  return Duration(static_cast<std::int64_t>(std::min(ns, kLongest_ns) + 0.5));
}

}  // namespace

ExecutionTime::ExecutionTime(Duration constant) : a_(constant) {
  require_not_negative("constant", constant);
}

ExecutionTime ExecutionTime::uniform(Duration low, Duration high) {
  require_not_negative("low", low);
  require_not_negative("high - low", high - low);
  ExecutionTime time;
  time.kind_ = Kind::kUniform;
  time.a_ = low;
  time.b_ = high;
  return time;
}

ExecutionTime ExecutionTime::log_normal(Duration median, double sigma) {
  require_not_negative("median", median);
  require_not_negative("sigma", sigma);
  ExecutionTime time;
  time.kind_ = Kind::kLogNormal;
  time.a_ = median;
  time.x_ = sigma;
  return time;
}

ExecutionTime ExecutionTime::counted_work(double ns_per_edge, Duration base) {
  require_not_negative("time per edge [ns]", ns_per_edge);
  require_not_negative("base", base);
  ExecutionTime time;
  time.kind_ = Kind::kWork;
  time.a_ = base;
  time.x_ = ns_per_edge;
  return time;
}

Duration ExecutionTime::of_call(RandomStream* stream, std::uint64_t work) const {
  switch (kind_) {
    case Kind::kConstant:
      break;
    case Kind::kUniform:
      return Duration(stream->integer(to_ns(a_), to_ns(b_)));
    case Kind::kLogNormal:
      return rounded(static_cast<double>(to_ns(a_)) * stream->log_normal(0, x_));
    case Kind::kWork:
      return a_ + rounded(static_cast<double>(work) * x_);
  }
  return a_;
}

}  // namespace orrery
