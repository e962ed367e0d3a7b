#include "catalogue.h"

#include <sqlite3.h>

#include <stdexcept>

namespace bedflow::server {
namespace {

constexpr const char* schema = R"(
  CREATE TABLE jobs (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    state INTEGER NOT NULL,
    retries INTEGER NOT NULL,
    from_step INTEGER,
    job BLOB NOT NULL);
  CREATE INDEX jobs_by_state ON jobs (state, number);
  CREATE TABLE requests (
    id TEXT PRIMARY KEY,
    job TEXT NOT NULL REFERENCES jobs (id),
    content BLOB NOT NULL) WITHOUT ROWID;
  PRAGMA user_version = 1;
)";

[[noreturn]] void fail(sqlite3* database, const std::string& doing) {
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
  if (version.number(0) > 1) throw std::runtime_error("catalogue: " + file.string() + " was written by a newer bedflowd");
  if (version.number(0) == 1) return;
  Transaction transaction(database);
  run(database, schema);
  transaction.commit();
}

Catalogue::~Catalogue() = default;

std::optional<Catalogue::Request> Catalogue::find_request(const std::string& request_id) const {
  Statement row(database_.get(), "SELECT job, content FROM requests WHERE id = ?");
  if (!row.bind(request_id).step()) return std::nullopt;
  return Request{row.bytes(0), row.bytes(1)};
}

void Catalogue::insert(JobRecord& record, const std::string& request_id, const std::string& content) {
  Transaction transaction(database_.get());
  Statement job(database_.get(), "INSERT INTO jobs (id, state, retries, from_step, job) VALUES (?, ?, ?, ?, ?)");
  job.bind(record.job.id()).bind(record.job.state()).bind(record.retries).bind(record.from_step);
  job.bind_blob(record.job.SerializeAsString()).step();
  record.number = sqlite3_last_insert_rowid(database_.get());
  if (!request_id.empty()) {
    Statement request(database_.get(), "INSERT INTO requests (id, job, content) VALUES (?, ?, ?)");
    request.bind(request_id).bind(record.job.id()).bind_blob(content).step();
  }
  transaction.commit();
}

void Catalogue::update(const JobRecord& record) {
  Statement job(database_.get(), "UPDATE jobs SET state = ?, retries = ?, from_step = ?, job = ? WHERE number = ?");
  job.bind(record.job.state()).bind(record.retries).bind(record.from_step).bind_blob(record.job.SerializeAsString());
  job.bind(record.number).step();
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

std::vector<JobRecord> Catalogue::page(std::int64_t below, const std::vector<v1::JobState>& states, std::int64_t most) const {
  const std::string wanted = states.empty() ? "" : " AND " + in_list(states);
  Statement rows(database_.get(), select("WHERE number < ?" + wanted + " ORDER BY number DESC LIMIT ?"));
  rows.bind(below).bind(most);
  return records_of(rows);
}

std::int64_t Catalogue::count(const std::vector<v1::JobState>& states) const {
  Statement row(database_.get(), "SELECT count(*) FROM jobs WHERE " + in_list(states));
  row.step();
  return row.number(0);
}

}  // namespace bedflow::server
