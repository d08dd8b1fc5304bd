#include <orrery/harness/campaign/campaign_database.hpp>
#include <orrery/harness/campaign/campaign_runner.hpp>

#include <cmath>
#include <memory>
#include <sqlite3.h>
#include <stdexcept>
#include <string>
#include <unistd.h>

namespace orrery {
namespace {

constexpr const char* kTables = R"(
CREATE TABLE campaign(name TEXT PRIMARY KEY, value) WITHOUT ROWID;
CREATE TABLE runs(run INTEGER PRIMARY KEY, seed INTEGER, outcome TEXT, exit INTEGER, signal INTEGER,
  fingerprint TEXT, simulated_s REAL, events INTEGER, wall_s REAL, cpu_s REAL, peak_kB INTEGER,
  site TEXT, failure TEXT, replay TEXT);
CREATE TABLE metrics(name TEXT, run INTEGER, value REAL, PRIMARY KEY(name, run)) WITHOUT ROWID;
CREATE TABLE dispersions(name TEXT, run INTEGER, value REAL, PRIMARY KEY(name, run)) WITHOUT ROWID;
CREATE TABLE distributions(name TEXT PRIMARY KEY, distribution TEXT) WITHOUT ROWID;
CREATE TABLE contradictions(run INTEGER, what TEXT);
)";

class Database {
 public:
  explicit Database(const std::filesystem::path& file) : file_(file.string()) {
    check(sqlite3_open(file_.c_str(), &db_));
    execute("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; BEGIN");
  }
  ~Database() { sqlite3_close(db_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void execute(const char* sql) { check(sqlite3_exec(db_, sql, nullptr, nullptr, nullptr)); }
  void check(int status) const {
    if (status == SQLITE_OK || status == SQLITE_DONE) return;
    throw std::runtime_error(file_ + ": " + sqlite3_errmsg(db_));
  }
  sqlite3* handle() const { return db_; }

 private:
  std::string file_;
  sqlite3* db_ = nullptr;
};

/// An INSERT whose values are given one after the other.
class Insert {
 public:
  Insert(const Database& database, const char* sql) : database_(database) {
    database_.check(sqlite3_prepare_v2(database.handle(), sql, -1, &statement_, nullptr));
  }
  ~Insert() { sqlite3_finalize(statement_); }
  Insert(const Insert&) = delete;
  Insert& operator=(const Insert&) = delete;

  template <class... Values>
  void row(const Values&... values) {
    int column = 0;
    (bind(++column, values), ...);
    database_.check(sqlite3_step(statement_));
    database_.check(sqlite3_reset(statement_));
  }

 private:
  void bind(int column, const std::string& text) {
    database_.check(sqlite3_bind_text(statement_, column, text.data(),
                                      static_cast<int>(text.size()), SQLITE_TRANSIENT));
  }
  void bind(int column, const char* text) { bind(column, std::string(text)); }
  void bind(int column, double value) {
    database_.check(std::isnan(value) ? sqlite3_bind_null(statement_, column)
                                      : sqlite3_bind_double(statement_, column, value));
  }
  template <class Integer>
  void bind(int column, Integer value) {
    database_.check(sqlite3_bind_int64(statement_, column, static_cast<sqlite3_int64>(value)));
  }

  const Database& database_;
  sqlite3_stmt* statement_ = nullptr;
};

void fill(const Database& database, const CampaignManifest& manifest, const MergedRuns& merged) {
  Insert campaign(database, "INSERT INTO campaign VALUES(?,?)");
  campaign.row("test", manifest.test);
  campaign.row("base_seed", manifest.base_seed);
  campaign.row("runs", manifest.runs);
  campaign.row("program", manifest.program);
  campaign.row("program_sha256", manifest.program_sha256);
  Insert runs(database, "INSERT INTO runs VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  Insert metrics(database, "INSERT INTO metrics VALUES(?,?,?)");
  Insert dispersions(database, "INSERT OR REPLACE INTO dispersions VALUES(?,?,?)");
  Insert distributions(database, "INSERT OR IGNORE INTO distributions VALUES(?,?)");
  for (const auto& [index, r] : merged.runs) {
    runs.row(r.run, r.seed, to_string(r.outcome), r.exit_code, r.signal, r.fingerprint,
             r.simulated_s, r.events, r.wall_s, r.cpu_s, r.peak_kB, r.failure_site, r.failure_text,
             replay_command_of(command_of(manifest, r.run)));
    for (const auto& [name, value] : r.metrics) metrics.row(name, r.run, value);
    for (const DrawnDispersion& d : r.dispersions) {
      dispersions.row(d.name, r.run, d.value);
      distributions.row(d.name, d.distribution);
    }
  }
  Insert contradictions(database, "INSERT INTO contradictions VALUES(?,?)");
  for (const Contradiction& one : merged.contradictions) contradictions.row(one.run, one.what);
}

}  // namespace

void write_database(const CampaignManifest& manifest, const MergedRuns& merged,
                    const std::filesystem::path& file) {
  // Whole or not at all.
  const std::filesystem::path beside = file.string() + "." + std::to_string(getpid());
  std::filesystem::remove(beside);
  {
    Database database(beside);
    database.execute(kTables);
    fill(database, manifest, merged);
    database.execute("COMMIT");
  }
  std::filesystem::rename(beside, file);
}

}  // namespace orrery
