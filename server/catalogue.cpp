#include "catalogue.h"

#include <sqlite3.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace bedflow::server {
namespace {

constexpr const char* jobs_table = R"(
  CREATE TABLE jobs (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    state INTEGER NOT NULL,
    retries INTEGER NOT NULL,
    from_step INTEGER,
    job BLOB NOT NULL,
    owner TEXT NOT NULL DEFAULT 'local');
  CREATE INDEX jobs_by_state ON jobs (state, number);
)";
constexpr const char* submissions_table = R"(
  CREATE TABLE submissions (
    number INTEGER PRIMARY KEY REFERENCES jobs (number),
    request_id TEXT UNIQUE,
    content BLOB NOT NULL);
)";
constexpr const char* from_version_1 = R"(
  INSERT INTO submissions SELECT jobs.number, requests.id, requests.content FROM requests JOIN jobs ON jobs.id = requests.job;
  DROP TABLE requests;
)";
constexpr const char* without_owners = "ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT 'local'";
constexpr const char* to_version_3 = R"(
  CREATE INDEX jobs_by_owner ON jobs (owner, state, number);
  PRAGMA user_version = 3;
)";
// Request ids of jobs that have been deleted.
constexpr const char* deleted_table =
    "CREATE TABLE IF NOT EXISTS deleted (request_id TEXT PRIMARY KEY, job TEXT NOT NULL, seconds INTEGER NOT NULL) WITHOUT ROWID";

// A commit that overwrites its part of the write-ahead log waits for the data alone; one that makes the log longer waits for the
// file system's journal too, twenty times as long. So the log is made as long as it will be until SQLite begins it anew (1000
// pages of 4096 bytes), once, before the first commit that somebody waits for.
constexpr const char* make_room = R"(
  BEGIN IMMEDIATE;
  CREATE TABLE room (bytes BLOB);
  INSERT INTO room VALUES (zeroblob(5000000));
  COMMIT;
  DROP TABLE room;
  PRAGMA wal_checkpoint(RESTART);
)";

[[noreturn]] void fail(sqlite3* database, const std::string& doing) {
  const int code = sqlite3_errcode(database) & 0xff;
  if (code == SQLITE_FULL || (code == SQLITE_IOERR && sqlite3_system_errno(database) == ENOSPC))
    throw std::system_error(ENOSPC, std::generic_category(), "catalogue: " + doing);
  throw std::runtime_error("catalogue: " + doing + ": " + sqlite3_errmsg(database));
}

void run(sqlite3* database, const char* sql) {
  if (sqlite3_exec(database, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail(database, sql);
}

class Statement {
 public:
  Statement(sqlite3* database, const std::string& sql) : database_(database) {
    if (sqlite3_prepare_v2(database, sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) fail(database, sql);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(std::int64_t value) { return checked(sqlite3_bind_int64(statement_, ++bound_, value)); }
  Statement& bind(const std::string& text) {
    return checked(sqlite3_bind_text64(statement_, ++bound_, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  }
  Statement& bind_blob(const std::string& bytes) {
    return checked(sqlite3_bind_blob64(statement_, ++bound_, bytes.data(), bytes.size(), SQLITE_TRANSIENT));
  }
  Statement& bind(const std::optional<std::uint64_t>& value) {
    return value ? bind(static_cast<std::int64_t>(*value)) : checked(sqlite3_bind_null(statement_, ++bound_));
  }
  void reset() { sqlite3_reset(statement_); }
  bool step() {  // true: there is a row
    const int result = sqlite3_step(statement_);
    if (result != SQLITE_ROW && result != SQLITE_DONE) fail(database_, "step");
    return result == SQLITE_ROW;
  }
  std::int64_t number(int column) const { return sqlite3_column_int64(statement_, column); }
  bool is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }
  std::string bytes(int column) const {
    const void* data = sqlite3_column_blob(statement_, column);
    return {static_cast<const char*>(data), static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
  }

 private:
  Statement& checked(int result) {
    if (result != SQLITE_OK) fail(database_, "bind");
    return *this;
  }
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

class Transaction {
 public:
  explicit Transaction(sqlite3* database) : database_(database) { run(database_, "BEGIN IMMEDIATE"); }
  ~Transaction() {
    if (database_) sqlite3_exec(database_, "ROLLBACK", nullptr, nullptr, nullptr);
  }
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit() {
    run(database_, "COMMIT");
    database_ = nullptr;
  }

 private:
  sqlite3* database_;
};

std::string select(const std::string& rest) {
  return "SELECT number, retries, from_step, job FROM jobs " + rest;
}

JobRecord record_of(const Statement& row) {
  JobRecord record;
  record.number = row.number(0);
  record.retries = static_cast<std::uint32_t>(row.number(1));
  if (!row.is_null(2)) record.from_step = static_cast<std::uint64_t>(row.number(2));
  if (!record.job.ParseFromString(row.bytes(3))) {
    throw std::runtime_error("catalogue: job number " + std::to_string(record.number) + " is damaged");
  }
  if (!record.job.has_owner()) record.job.set_owner(local_owner);  // of a time when there were no others
  return record;
}

std::vector<JobRecord> records_of(Statement& rows) {
  std::vector<JobRecord> records;
  while (rows.step()) records.push_back(record_of(rows));
  return records;
}

// Numbers of an enum, no text from outside.
std::string in_list(const std::vector<v1::JobState>& states) {
  std::string list;
  for (const auto state : states) {
    if (!list.empty()) list += ',';
    list += std::to_string(static_cast<int>(state));
  }
  return "state IN (" + list + ")";
}

}  // namespace

void Catalogue::Close::operator()(sqlite3* database) const {
  sqlite3_close(database);
}

Catalogue::Catalogue(const std::filesystem::path& file) {
  sqlite3* database = nullptr;
  const int result =
      sqlite3_open_v2(file.c_str(), &database, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(database);
  if (result != SQLITE_OK) fail(database, "opening " + file.string());
  run(database, "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON; PRAGMA busy_timeout=2000;");
  Statement version(database, "PRAGMA user_version");
  version.step();
  const auto found = version.number(0);
  version.reset();
  if (found > 3) throw std::runtime_error("catalogue: " + file.string() + " was written by a newer bedflowd");
  if (found < 3) {
    Transaction transaction(database);
    run(database, found == 0 ? jobs_table : without_owners);
    if (found < 2) run(database, submissions_table);
    if (found == 1) run(database, from_version_1);
    run(database, to_version_3);
    transaction.commit();
  }
  run(database, deleted_table);
  int keep = 1;  // the log stays as long as it is when the server ends
  sqlite3_file_control(database, nullptr, SQLITE_FCNTL_PERSIST_WAL, &keep);
  std::error_code none;
  const auto log_bytes = std::filesystem::file_size(file.string() + "-wal", none);
  if ((none || log_bytes < 4'000'000) && sqlite3_exec(database, make_room, nullptr, nullptr, nullptr) != SQLITE_OK) {
    sqlite3_exec(database, "ROLLBACK", nullptr, nullptr, nullptr);  // a disk too full for it: commits are slower, no more
  }
}

Catalogue::~Catalogue() = default;

std::optional<Catalogue::Request> Catalogue::find_request(const std::string& request_id) const {
  Statement row(database_.get(), "SELECT id, content FROM submissions JOIN jobs USING (number) WHERE request_id = ?");
  if (row.bind(request_id).step()) return Request{row.bytes(0), row.bytes(1)};
  Statement deleted(database_.get(), "SELECT job, seconds FROM deleted WHERE request_id = ?");
  if (!deleted.bind(request_id).step()) return std::nullopt;
  return Request{deleted.bytes(0), {}, deleted.number(1)};
}

void Catalogue::insert(JobRecord& record, const std::string& request_id, const std::string& content) {
  Transaction transaction(database_.get());
  Statement job(database_.get(), "INSERT INTO jobs (id, state, retries, from_step, job, owner) VALUES (?, ?, ?, ?, ?, ?)");
  job.bind(record.job.id()).bind(record.job.state()).bind(record.retries).bind(record.from_step);
  job.bind_blob(record.job.SerializeAsString()).bind(record.job.has_owner() ? record.job.owner() : local_owner).step();
  record.number = sqlite3_last_insert_rowid(database_.get());
  Statement submission(database_.get(), "INSERT INTO submissions (number, request_id, content) VALUES (?, nullif(?, ''), ?)");
  submission.bind(record.number).bind(request_id).bind_blob(content).step();
  transaction.commit();
}

std::string Catalogue::content(const JobRecord& record) const {
  Statement row(database_.get(), "SELECT content FROM submissions WHERE number = ?");
  return row.bind(record.number).step() ? row.bytes(0) : std::string();
}

void Catalogue::update(const JobRecord& record) {
  Statement job(database_.get(), "UPDATE jobs SET state = ?, retries = ?, from_step = ?, job = ? WHERE number = ?");
  job.bind(record.job.state()).bind(record.retries).bind(record.from_step).bind_blob(record.job.SerializeAsString());
  job.bind(record.number).step();
}

void Catalogue::erase(const std::string& id, std::int64_t deleted) {
  Transaction transaction(database_.get());
  Statement(database_.get(), "DELETE FROM deleted WHERE seconds < ?")
      .bind(deleted - std::chrono::seconds(remembered).count())
      .step();
  Statement(database_.get(),
            "INSERT OR REPLACE INTO deleted SELECT request_id, ?, ? FROM submissions "
            "WHERE request_id IS NOT NULL AND number = (SELECT number FROM jobs WHERE id = ?)")
      .bind(id)
      .bind(deleted)
      .bind(id)
      .step();
  Statement(database_.get(), "DELETE FROM submissions WHERE number = (SELECT number FROM jobs WHERE id = ?)").bind(id).step();
  Statement(database_.get(), "DELETE FROM jobs WHERE id = ?").bind(id).step();
  transaction.commit();
}

std::optional<JobRecord> Catalogue::find(const std::string& id) const {
  Statement row(database_.get(), select("WHERE id = ?"));
  if (!row.bind(id).step()) return std::nullopt;
  return record_of(row);
}

std::vector<JobRecord> Catalogue::in_states(const std::vector<v1::JobState>& states, std::int64_t most) const {
  Statement rows(database_.get(), select("WHERE " + in_list(states) + " ORDER BY number LIMIT ?"));
  rows.bind(most);
  return records_of(rows);
}

std::vector<JobRecord> Catalogue::page(std::int64_t below, const std::vector<v1::JobState>& states, std::int64_t most,
                                       const std::string& owner) const {
  std::string wanted = "WHERE number < ?";
  if (!states.empty()) wanted += " AND " + in_list(states);
  if (!owner.empty()) wanted += " AND owner = ?";
  Statement rows(database_.get(), select(wanted + " ORDER BY number DESC LIMIT ?"));
  rows.bind(below);
  if (!owner.empty()) rows.bind(owner);
  rows.bind(most);
  return records_of(rows);
}

std::int64_t Catalogue::count(const std::vector<v1::JobState>& states, const std::string& owner) const {
  Statement row(database_.get(), "SELECT count(*) FROM jobs WHERE " + in_list(states) + (owner.empty() ? "" : " AND owner = ?"));
  if (!owner.empty()) row.bind(owner);
  row.step();
  return row.number(0);
}

std::int64_t Catalogue::count_of(const std::string& owner) const {
  Statement row(database_.get(), "SELECT count(*) FROM jobs WHERE ?1 = '' OR owner = ?1");
  row.bind(owner).step();
  return row.number(0);
}

std::map<v1::JobState, std::uint64_t> Catalogue::counts() const {
  std::map<v1::JobState, std::uint64_t> counts;
  Statement rows(database_.get(), "SELECT state, count(*) FROM jobs GROUP BY state");
  while (rows.step()) counts[static_cast<v1::JobState>(rows.number(0))] = static_cast<std::uint64_t>(rows.number(1));
  return counts;
}

void Catalogue::copy(const std::filesystem::path& from, const std::filesystem::path& to) {
  const auto open = [](const std::filesystem::path& file, int flags) {
    sqlite3* database = nullptr;
    const int result = sqlite3_open_v2(file.c_str(), &database, flags, nullptr);
    std::unique_ptr<sqlite3, Close> held(database);
    if (result != SQLITE_OK) fail(database, "opening " + file.string());
    run(database, "PRAGMA busy_timeout=10000");
    return held;
  };
  const auto source = open(from, SQLITE_OPEN_READWRITE);  // a reader of a write-ahead log writes its index
  const auto target = open(to, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  sqlite3_backup* backup = sqlite3_backup_init(target.get(), "main", source.get(), "main");
  if (!backup) fail(target.get(), "copying to " + to.string());
  sqlite3_backup_step(backup, -1);
  if (sqlite3_backup_finish(backup) != SQLITE_OK) fail(target.get(), "copying to " + to.string());
}

}  // namespace bedflow::server
