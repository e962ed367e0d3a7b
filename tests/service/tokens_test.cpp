// Tokens and owners, without a server: what is kept of a token, who may act on a job, databases of a time without owners.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <fstream>
#include <iomanip>
#include <sstream>

#include "catalogue.h"
#include "door.h"
#include "folder.h"
#include "refusal.h"
#include "security.h"
#include "support/server_process.h"
#include "token.h"
#include "tokens.h"

namespace bedflow::server {
namespace {

using test::TemporaryFolder;

v1::Token token_for(const TokenText& text, const std::string& owner, v1::Scope scope = v1::SUBMIT,
                    std::chrono::seconds life = std::chrono::hours(1)) {
  v1::Token token;
  token.set_id(text.id);
  token.set_owner(owner);
  token.set_scope(scope);
  token.set_secret_sha256(sha256(text.secret));
  token.set_expires_unix_nanos(now_nanos() + std::chrono::nanoseconds(life).count());
  return token;
}

std::string refusal_of(Tokens& tokens, const v1::Token& token) {
  try {
    tokens.add(token);
    return "taken";
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
}

TEST(TokenText, IsReadBackToTheLetterAndNothingElseIs) {
  const auto made = new_token();
  const auto read = read_token(made.text());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->id, made.id);
  EXPECT_EQ(read->secret, made.secret);
  EXPECT_NE(new_token().secret, made.secret);
  std::string upper = made.text();
  upper.back() = 'F';
  for (const std::string& text : {std::string(), std::string("bedflow_"), made.secret, made.text() + "0", made.text() + "\n",
                                  upper, made.text().substr(1), made.text() + made.text()}) {
    EXPECT_FALSE(read_token(text)) << text;
  }
}

TEST(TokenText, ItsHashIsSha256) {  // FIPS 180-4's example
  const std::string hash = sha256("abc");
  EXPECT_EQ(hash.substr(0, 4), "\xba\x78\x16\xbf");
  EXPECT_EQ(hash.substr(28), std::string("\xf2\x00\x15\xad", 4));
  EXPECT_TRUE(is_same_hash(hash, sha256("abc")));
  EXPECT_FALSE(is_same_hash(hash, sha256("abd")));
  EXPECT_FALSE(is_same_hash(hash, hash.substr(1)));
}

TEST(Tokens, AreTakenAsWhatTheyAre) {
  const TemporaryFolder folder;
  Tokens tokens(folder.path() / "tokens.txtpb");
  const auto text = new_token(), other = new_token();
  tokens.add(token_for(text, "alice"));
  Caller caller;
  EXPECT_EQ(tokens.look_at("", caller), Shown::none);
  EXPECT_EQ(tokens.look_at("Bearer", caller), Shown::malformed);
  EXPECT_EQ(tokens.look_at(text.text(), caller), Shown::malformed);
  EXPECT_EQ(tokens.look_at("Basic " + text.text(), caller), Shown::malformed);
  EXPECT_EQ(tokens.look_at("Bearer  " + text.text(), caller), Shown::malformed);
  EXPECT_EQ(tokens.look_at("Bearer " + other.text(), caller), Shown::unknown);
  EXPECT_EQ(tokens.look_at("Bearer " + TokenText{text.id, other.secret}.text(), caller), Shown::unknown);
  EXPECT_EQ(tokens.look_at("Bearer " + TokenText{other.id, text.secret}.text(), caller), Shown::unknown);
  EXPECT_EQ(caller.owner, local_owner) << "a caller was made of a token that is not good";
  EXPECT_EQ(tokens.look_at("bearer " + text.text(), caller), Shown::good);
  EXPECT_EQ(caller.owner, "alice");
  EXPECT_EQ(caller.scope, v1::SUBMIT);
}

TEST(Tokens, AreKeptAsHashesOverAReopening) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "tokens.txtpb";
  const auto text = new_token();
  Tokens(file).add(token_for(text, "alice", v1::READ));
  const std::string kept = read_text(file);
  EXPECT_THAT(kept, testing::HasSubstr(text.id));
  EXPECT_THAT(kept, testing::Not(testing::HasSubstr(text.secret)));
  const Tokens again(file);
  Caller caller;
  EXPECT_EQ(again.look_at("Bearer " + text.text(), caller), Shown::good);
  EXPECT_EQ(caller.scope, v1::READ);
  ASSERT_EQ(again.list().size(), 1u);
  EXPECT_FALSE(again.list().front().has_secret_sha256());
}

TEST(Tokens, OfADamagedFileAreNotTakenForNone) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "tokens.txtpb") << "tokens { id: ";
  EXPECT_THROW(Tokens(folder.path() / "tokens.txtpb"), std::runtime_error);
}

TEST(Tokens, ThatAreRevokedOrExpireHoldNoLongerInCallsUnderWayNeither) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "tokens.txtpb";
  Tokens tokens(file);
  const auto text = new_token(), brief = new_token();
  tokens.add(token_for(text, "alice"));
  tokens.add(token_for(brief, "bob", v1::SUBMIT, std::chrono::seconds(1)));
  Caller alice, bob;
  ASSERT_EQ(tokens.look_at("Bearer " + text.text(), alice), Shown::good);
  ASSERT_EQ(tokens.look_at("Bearer " + brief.text(), bob), Shown::good);
  EXPECT_NO_THROW(alice.require_still_good());
  EXPECT_EQ(tokens.revoke("", "alice").size(), 1u);
  EXPECT_THROW(alice.require_still_good(), Refusal);
  EXPECT_THROW(tokens.caller_of(text.id), Refusal);
  EXPECT_EQ(tokens.look_at("Bearer " + text.text(), alice), Shown::unknown);
  EXPECT_EQ(Tokens(file).look_at("Bearer " + text.text(), alice), Shown::unknown);
  EXPECT_TRUE(test::holds_within(std::chrono::seconds(5),
                                 [&] { return tokens.look_at("Bearer " + brief.text(), bob) == Shown::expired; }));
  EXPECT_THROW(bob.require_still_good(), Refusal);
  EXPECT_THROW(tokens.revoke("", "nobody"), Refusal);
  EXPECT_THROW(tokens.revoke("", ""), Refusal);
}

TEST(Tokens, ThatAreNotInOrderAreRefusedWithTheField) {
  const TemporaryFolder folder;
  Tokens tokens(folder.path() / "tokens.txtpb");
  const auto good = token_for(new_token(), "alice");
  for (const std::string owner : {"", "local", "Alice", "../x", "a/b", "a b", "-a"}) {
    auto token = good;
    token.set_owner(owner);
    EXPECT_THAT(refusal_of(tokens, token), testing::HasSubstr("token.owner")) << owner;
  }
  auto token = good;
  token.set_id("../../../etc");
  EXPECT_THAT(refusal_of(tokens, token), testing::HasSubstr("token.id"));
  token = good, token.clear_scope();
  EXPECT_THAT(refusal_of(tokens, token), testing::HasSubstr("token.scope"));
  token = good, token.set_secret_sha256("short");
  EXPECT_THAT(refusal_of(tokens, token), testing::HasSubstr("token.secret_sha256"));
  for (const std::int64_t expires : {std::int64_t{0}, now_nanos(), INT64_MAX, INT64_MIN}) {
    token = good, token.set_expires_unix_nanos(expires);
    EXPECT_THAT(refusal_of(tokens, token), testing::HasSubstr("token.expires_unix_nanos")) << expires;
  }
  EXPECT_EQ(refusal_of(tokens, good), "taken");
  EXPECT_THAT(refusal_of(tokens, good), testing::HasSubstr("already"));
}

TEST(Scopes, EveryMethodOfTheSchemaHasOneAndNothingElseIsOpen) {
  const auto* file = v1::Job::descriptor()->file();
  ASSERT_GT(file->service_count(), 0);
  for (int s = 0; s < file->service_count(); ++s) {
    for (int m = 0; m < file->service(s)->method_count(); ++m) {
      const auto* method = file->service(s)->method(m);
      EXPECT_NE(scope_needed("/" + file->service(s)->full_name() + "/" + method->name()), v1::SCOPE_NONE)
          << method->full_name() << " has no option (needs): it would be closed to all tokens";
    }
  }
  EXPECT_EQ(scope_needed("/bedflow.v1.JobService/GetJob"), v1::READ);
  EXPECT_EQ(scope_needed("/bedflow.v1.JobService/CancelJob"), v1::SUBMIT);
  EXPECT_EQ(scope_needed("/bedflow.v1.JobService/CreateToken"), v1::ADMIN);
  for (const char* path : {"", "/", "/bedflow.v1.JobService/", "/bedflow.v1.JobService/Nothing", "bedflow.v1.JobService/GetJob"})
    EXPECT_EQ(scope_needed(path), v1::SCOPE_NONE) << path;
}

TEST(Owners, ActOnTheirOwnJobsAndAdminsOnAll) {
  EXPECT_TRUE(Caller().may_act_on("alice")) << "the server's own user is an admin";
  EXPECT_TRUE((Caller{"alice", v1::SUBMIT}).may_act_on("alice"));
  EXPECT_FALSE((Caller{"alice", v1::READ}).may_act_on("alice"));
  EXPECT_FALSE((Caller{"bob", v1::SUBMIT}).may_act_on("alice"));
  EXPECT_TRUE((Caller{"bob", v1::ADMIN}).may_act_on("alice"));
}

TEST(Address, BeyondLoopbackIsAcceptedWithTlsAlone) {
  EXPECT_EQ(listen_address("0.0.0.0:7443", true), "0.0.0.0:7443");
  EXPECT_EQ(listen_address("[::]:7443", true), "[::]:7443");
  EXPECT_EQ(listen_address("bed.example.org:7443", true), "bed.example.org:7443");
  EXPECT_THROW(listen_address("0.0.0.0:7443", false), std::invalid_argument);
  for (const char* address : {":7443", "a b:7443", "[x]:7443", "dns:///a:7443", "a/b:7443"})
    EXPECT_THROW(listen_address(address, true), std::invalid_argument) << address;
}

class Database {
 public:
  explicit Database(const std::filesystem::path& file) { sqlite3_open(file.c_str(), &database_); }
  ~Database() { sqlite3_close(database_); }
  void run(const std::string& sql) {
    ASSERT_EQ(sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
  }

 private:
  sqlite3* database_ = nullptr;
};

std::string hex_of(const std::string& bytes) {
  std::ostringstream text;
  for (const char c : bytes) text << std::hex << std::setw(2) << std::setfill('0') << (static_cast<unsigned>(c) & 0xffU);
  return text.str();
}

v1::Job old_job(const std::string& id) {
  v1::Job job;
  job.set_id(id);
  job.set_state(v1::PENDING);
  return job;
}

// The tables as they were written before jobs had owners.
constexpr const char* jobs_before = R"(
  CREATE TABLE jobs (number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, state INTEGER NOT NULL,
    retries INTEGER NOT NULL, from_step INTEGER, job BLOB NOT NULL);
  CREATE INDEX jobs_by_state ON jobs (state, number);
)";

void insert_old_jobs(Database& database) {
  for (const std::string id : {"j-000000000001", "j-000000000002"}) {
    database.run("INSERT INTO jobs (id, state, retries, job) VALUES ('" + id + "', 1, 0, x'" +
                 hex_of(old_job(id).SerializeAsString()) + "')");
  }
}

void expect_old_jobs(const std::filesystem::path& file) {
  Catalogue catalogue(file);
  const auto found = catalogue.find("j-000000000001");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->job.owner(), local_owner);
  EXPECT_EQ(catalogue.count({v1::PENDING}, local_owner), 2);
  EXPECT_EQ(catalogue.count({v1::PENDING}, "alice"), 0);
  ASSERT_TRUE(catalogue.find_request("request-1"));
  EXPECT_EQ(catalogue.find_request("request-1")->job, "j-000000000001");
  EXPECT_EQ(catalogue.find_request("request-1")->content, "asked");
  JobRecord record;
  record.job = old_job("j-000000000003");
  record.job.set_owner("alice");
  catalogue.insert(record, "alice/request-1", "asked too");
  EXPECT_EQ(record.number, 3);
  EXPECT_EQ(catalogue.page(INT64_MAX, {}, 10, "alice").size(), 1u);
  EXPECT_EQ(catalogue.page(INT64_MAX, {}, 10).size(), 3u);
}

TEST(Catalogue, OfVersion1OpensAndItsJobsAreLocal) {
  const TemporaryFolder folder;
  {
    Database database(folder.path() / "c");
    database.run(jobs_before);
    database.run("CREATE TABLE requests (id TEXT PRIMARY KEY, job TEXT NOT NULL, content BLOB NOT NULL)");
    insert_old_jobs(database);
    database.run("INSERT INTO requests VALUES ('request-1', 'j-000000000001', 'asked')");
    database.run("PRAGMA user_version = 1");
  }
  expect_old_jobs(folder.path() / "c");
  EXPECT_NO_THROW(Catalogue(folder.path() / "c")) << "a second time";
}

TEST(Catalogue, OfVersion2OpensAndItsJobsAreLocal) {
  const TemporaryFolder folder;
  {
    Database database(folder.path() / "c");
    database.run(jobs_before);
    database.run(R"(CREATE TABLE submissions (number INTEGER PRIMARY KEY REFERENCES jobs (number), request_id TEXT UNIQUE,
                    content BLOB NOT NULL))");
    insert_old_jobs(database);
    database.run("INSERT INTO submissions VALUES (1, 'request-1', 'asked')");
    database.run("INSERT INTO submissions VALUES (2, NULL, 'asked')");
    database.run("PRAGMA user_version = 2");
  }
  expect_old_jobs(folder.path() / "c");
  EXPECT_NO_THROW(Catalogue(folder.path() / "c")) << "a second time";
}

TEST(Catalogue, OfANewerServerIsRefused) {
  const TemporaryFolder folder;
  Database(folder.path() / "c").run("PRAGMA user_version = 99");
  EXPECT_THROW(Catalogue(folder.path() / "c"), std::runtime_error);
}

}  // namespace
}  // namespace bedflow::server
