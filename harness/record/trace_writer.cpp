#include <orrery/harness/record/number_format.hpp>
#include <orrery/harness/record/trace_writer.hpp>

#include <algorithm>
#include <stdexcept>

namespace orrery {

TraceWriter::TraceWriter(const std::filesystem::path& path, SimTime start)
    : file_(path), start_(start), last_(start) {
  file_.write("{\"displayTimeUnit\":\"ns\",\"traceEvents\":[");
}

TraceWriter::Track TraceWriter::track(std::string_view process, std::string_view thread) {
  auto p = std::find_if(processes_.begin(), processes_.end(),
                        [process](const auto& one) { return one.first == process; });
  const int pid = static_cast<int>(p - processes_.begin()) + 1;
  if (p == processes_.end()) {
    processes_.emplace_back(process, std::vector<Thread>());
    p = processes_.end() - 1;
    write_name("process_name", {pid, 0}, process);
  }
  const auto t = std::find_if(p->second.begin(), p->second.end(),
                              [thread](const Thread& one) { return one.name == thread; });
  const int tid = static_cast<int>(t - p->second.begin()) + 1;
  if (t == p->second.end()) {
    p->second.push_back({std::string(thread)});
    write_name("thread_name", {pid, tid}, thread);
  }
  return {pid, tid};
}

void TraceWriter::write_name(const char* what, Track track, std::string_view name) {
  line_ += first_ ? "\n" : ",\n";
  first_ = false;
  line_ += "{\"ph\":\"M\",\"pid\":" + std::to_string(track.process) +
           ",\"tid\":" + std::to_string(track.thread) + ",\"name\":\"" + what + '"';
  end_event(JsonObject().add("name", name));
}

void TraceWriter::instant(Track track, SimTime t, std::string_view name, const JsonObject& args) {
  move_to(t);
  open_event('i', track, t, name);
  line_ += ",\"s\":\"t\"";
  end_event(args);
}

void TraceWriter::moment(Track track, SimTime t, std::string_view name, const JsonObject& args) {
  move_to(t);
  require(track, Holds::kMoments);
  open_event('X', track, t, name);
  line_ += ",\"cat\":\"message\",\"dur\":0.001";
  end_event(args);
}

void TraceWriter::slice(Track track, SimTime t, Duration length, std::string_view name,
                        const JsonObject& args) {
  if (length > Duration::zero()) {
    begin(track, t, name, args);
    open_.back().until = t + length;
    return;
  }
  move_to(t);
  require(track, Holds::kSlices);
  end(track, t);
  open_event('X', track, t, name);
  line_ += ",\"dur\":0";
  end_event(args);
}

void TraceWriter::begin(Track track, SimTime t, std::string_view name, const JsonObject& args) {
  move_to(t);
  require(track, Holds::kSlices);
  end(track, t);
  open_.push_back({t, SimTime::max(), begun_++, track, std::string(name), args.members()});
}

void TraceWriter::end(Track track, SimTime t) {
  move_to(t);
  const auto found = std::find_if(open_.begin(), open_.end(),
                                  [track](const Open& one) { return one.track == track; });
  if (found == open_.end()) return;
  const Open one = *found;
  open_.erase(found);
  write_end(one, t);
}

void TraceWriter::write_begins() {
  for (Open& one : open_) {
    if (one.is_written) continue;
    open_event('B', one.track, one.from, one.name);
    end_event(one.args);
    one.is_written = true;
  }
}

void TraceWriter::write_end(const Open& one, SimTime t) {
  open_event(one.is_written ? 'E' : 'X', one.track, t, one.name);
  if (!one.is_written) line_ += ",\"dur\":0";
  end_event(one.is_written ? std::string_view() : one.args);
}

void TraceWriter::counter(Track track, SimTime t, std::string_view name, const JsonObject& values) {
  move_to(t);
  open_event('C', track, t, name);
  end_event(values);
}

void TraceWriter::flow_start(Track track, SimTime t, std::string_view name, std::uint64_t id) {
  move_to(t);
  open_event('s', track, t, name);
  line_ += ",\"cat\":\"message\",\"id\":" + std::to_string(id);
  end_event(std::string_view());
}

void TraceWriter::flow_end(Track track, SimTime t, std::string_view name, std::uint64_t id) {
  move_to(t);
  open_event('f', track, t, name);
  line_ += ",\"cat\":\"message\",\"bp\":\"e\",\"id\":" + std::to_string(id);
  end_event(std::string_view());
}

void TraceWriter::close(SimTime t) {
  move_to(t);
  for (const Open& one : open_) write_end(one, t);
  open_.clear();
  file_.write("\n]}\n");
  file_.close();
}

void TraceWriter::require(Track track, Holds holds) {
  Thread& thread = processes_[static_cast<std::size_t>(track.process - 1)]
                       .second[static_cast<std::size_t>(track.thread - 1)];
  if (thread.holds == Holds::kNothing) thread.holds = holds;
  if (thread.holds == holds) return;
  throw std::logic_error("TraceWriter: track " + thread.name +
                         " has moments for flows and slices that take time");
}

// Writes the ends that have become due, so that the file is in order of time.
void TraceWriter::move_to(SimTime t) {
  if (t < last_) {
    throw std::logic_error("TraceWriter: " + to_string(t - start_) + " comes after " +
                           to_string(last_ - start_));
  }
  if (t > last_) write_begins();
  while (!open_.empty()) {
    const auto due = std::min_element(open_.begin(), open_.end(), [](const Open& a, const Open& b) {
      return std::pair(a.until, a.number) < std::pair(b.until, b.number);
    });
    if (due->until > t) break;
    const Open one = *due;
    open_.erase(due);
    write_end(one, one.until);
  }
  last_ = t;
}

void TraceWriter::open_event(char phase, Track track, SimTime t, std::string_view name) {
  line_ += first_ ? "\n" : ",\n";
  first_ = false;
  line_ += "{\"ph\":\"";
  line_ += phase;
  line_ += "\",\"pid\":";
  append_number(line_, std::int64_t{track.process});
  line_ += ",\"tid\":";
  append_number(line_, std::int64_t{track.thread});
  line_ += ",\"ts\":";
  append_ts(t);
  line_ += ",\"name\":";
  append_json_text(line_, name);
}

void TraceWriter::append_ts(SimTime t) {
  const std::int64_t ns = to_ns(t - start_);
  append_number(line_, ns / 1000);
  const std::int64_t part = ns % 1000;
  if (part == 0) return;
  line_ += '.';
  line_ += static_cast<char>('0' + part / 100);
  line_ += static_cast<char>('0' + part / 10 % 10);
  line_ += static_cast<char>('0' + part % 10);
}

void TraceWriter::end_event(std::string_view args) {
  if (!args.empty()) {
    line_ += ",\"args\":{";
    line_ += args;
    line_ += '}';
  }
  line_ += '}';
  file_.write(line_);
  line_.clear();
}

}  // namespace orrery
