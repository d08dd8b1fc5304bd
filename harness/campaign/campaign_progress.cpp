#include <orrery/harness/campaign/campaign_progress.hpp>

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace orrery {
namespace {

constexpr int kBar = 24;

std::string span(double seconds) {
  char text[32];
  if (seconds < 120) {
    std::snprintf(text, sizeof text, "%.0f s", seconds);
  } else if (seconds < 7200) {
    std::snprintf(text, sizeof text, "%.0f min", seconds / 60);
  } else {
    std::snprintf(text, sizeof text, "%.1f h", seconds / 3600);
  }
  return text;
}

}  // namespace

CampaignProgress::CampaignProgress(bool quiet) : visible_(!quiet && isatty(STDERR_FILENO) == 1) {}

void CampaignProgress::count(const RunRecord& run) {
  ++done_;
  ++outcomes_.at(static_cast<std::size_t>(run.outcome));
}

double CampaignProgress::seconds() const {
  return std::chrono::duration<double>(HostClock::now() - begin_).count();
}

std::string CampaignProgress::counts() const {
  std::string text;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (outcomes_[i] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(to_string(static_cast<RunOutcome>(i))) + " " +
            std::to_string(outcomes_[i]);
  }
  return text.empty() ? "none has ended" : text;
}

std::string CampaignProgress::line() const {
  const double spent_s = seconds(), rate = spent_s > 0 ? done_ / spent_s : 0;
  char figures[64];
  std::snprintf(figures, sizeof figures, "%.3g runs/s", rate);
  if (runs_ == 0) return std::to_string(done_) + " runs, " + figures + ", " + counts();
  const int filled = static_cast<int>(std::uint64_t{done_} * kBar / std::max(runs_, 1u));
  std::string text = "[" + std::string(static_cast<std::size_t>(filled), '=') +
                     std::string(static_cast<std::size_t>(kBar - filled), ' ') + "] " +
                     std::to_string(done_) + "/" + std::to_string(runs_) + ", " + figures;
  if (done_ > 0 && done_ < runs_) text += ", " + span((runs_ - done_) / rate) + " left";
  return text + ", " + counts();
}

void CampaignProgress::show() {
  const auto now = HostClock::now();
  if (!visible_ || now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  shown_ = true;
  std::fprintf(stderr, "\r\033[K%s", line().c_str());
}

void CampaignProgress::clear() {
  if (!shown_) return;
  std::fputs("\r\033[K", stderr);
  shown_ = false;
}

}  // namespace orrery
