#include "import.h"

#include <atomic>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "case_file.h"
#include "download.h"
#include "refusal.h"
#include "security.h"
#include "service.h"
#include "submission.h"

namespace bedflow::server {
namespace {

constexpr int most_imports = 4;  // at once

// A place among the imports that may go on at once.
class Place {
 public:
  Place() {
    if (++taken > most_imports) {
      --taken;
      throw Refusal(Refused::too_much, std::to_string(most_imports) + " checkpoints are being imported already; try again later");
    }
  }
  ~Place() { --taken; }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;

 private:
  static inline std::atomic<int> taken = 0;
};

// One import: a draft of a job's folder, and the file that comes in beside it.
class Import {
 public:
  Import(Jobs& jobs, Readers& readers, const Caller& caller, const v1::ImportCheckpointRequest::Head& head)
      : jobs_(jobs), readers_(readers), caller_(caller), head_(head), draft_(jobs.new_draft()), upload_(file(), head) {}

  void take(const v1::ImportCheckpointRequest& part) {
    caller_.require_still_good();
    upload_.take(part);
  }
  v1::Job finish() {
    caller_.require_still_good();
    const std::uint32_t crc = upload_.finish();
    const auto report = readers_.import(file(), draft_.folder.root());
    std::filesystem::remove(file());
    return jobs_.import(caller_, head_, draft_.folder, report, crc);
  }

 private:
  std::filesystem::path file() const { return draft_.folder.root() / "upload"; }

  Jobs& jobs_;
  Readers& readers_;
  const Caller caller_;
  const Place place_;
  const v1::ImportCheckpointRequest::Head head_;
  const DraftFolder draft_;
  Upload upload_;
};

class Importer final : public grpc::ServerReadReactor<v1::ImportCheckpointRequest>,
                       public std::enable_shared_from_this<Importer> {
 public:
  Importer(Jobs& jobs, Readers& readers, const Door& door, boost::asio::thread_pool& pool, grpc::CallbackServerContext* context,
           v1::Job* response, std::function<void()> done)
      : jobs_(jobs),
        readers_(readers),
        door_(door),
        pool_(pool),
        context_(context),
        response_(response),
        done_(std::move(done)),
        timer_(pool) {}

  void start(std::shared_ptr<Importer> self) {
    self_ = std::move(self);
    read();
  }
  void OnReadDone(bool ok) override {
    stop_timer();
    boost::asio::post(pool_, [self = shared_from_this(), ok] { self->go_on(ok); });
  }
  void OnDone() override {
    stop_timer();
    done_();
    self_.reset();
  }

 private:
  static constexpr auto longest_silence = std::chrono::seconds(60);  // between two parts

  void read() {
    {
      const std::lock_guard guard(timer_mutex_);
      timer_.expires_after(longest_silence);
      timer_.async_wait([self = shared_from_this()](const boost::system::error_code& stopped) {
        if (!stopped) self->context_->TryCancel();
      });
    }
    StartRead(&part_);
  }

  // What was put together is gone before the client hears how it ended.
  void end(const grpc::Status& status) {
    import_.reset();
    Finish(status);
  }

  void go_on(bool has_part) {
    if (context_->IsCancelled()) return end(grpc::Status::CANCELLED);
    try {
      if (!has_part) {
        if (!import_) throw Refusal(Refused::bad_upload, "nothing came: the first message has the head");
        *response_ = import_->finish();
        return end(grpc::Status::OK);
      }
      if (!import_) {
        if (!part_.has_head()) throw Refusal(Refused::bad_upload, "the first message has no head");
        import_.emplace(jobs_, readers_, door_.caller(*context_), part_.head());
      } else if (part_.has_head()) {
        throw Refusal(Refused::bad_upload, "a second head came");
      }
      if (part_.has_data()) import_->take(part_);
      read();
    } catch (const std::exception& failure) {
      end(status_of_failure(failure));
    }
  }

  void stop_timer() {
    const std::lock_guard guard(timer_mutex_);
    timer_.cancel();
  }

  Jobs& jobs_;
  Readers& readers_;
  const Door& door_;
  boost::asio::thread_pool& pool_;
  grpc::CallbackServerContext* const context_;
  v1::Job* const response_;
  const std::function<void()> done_;
  std::mutex timer_mutex_;
  boost::asio::steady_timer timer_;
  v1::ImportCheckpointRequest part_;
  std::optional<Import> import_;
  std::shared_ptr<Importer> self_;
};

}  // namespace

grpc::ServerReadReactor<v1::ImportCheckpointRequest>* open_import(Jobs& jobs, Readers& readers, const Door& door,
                                                                  boost::asio::thread_pool& pool,
                                                                  grpc::CallbackServerContext* context, v1::Job* response,
                                                                  std::function<void()> done) {
  auto importer = std::make_shared<Importer>(jobs, readers, door, pool, context, response, std::move(done));
  importer->start(importer);
  return importer.get();
}

// -------------------------------------------------------------------------------------------------------- the job

DraftFolder Jobs::new_draft() const {
  return DraftFolder(settings_.data / "drafts" / new_job_id());
}

v1::Job Jobs::import(const Caller& caller, const v1::ImportCheckpointRequest::Head& head, const JobFolder& draft,
                     const v1::CheckpointReport& report, std::uint32_t crc) {
  v1::CreateJobRequest request;
  *request.mutable_spec() = head.spec();
  if (head.has_request_id()) request.set_request_id(head.request_id());
  if (!read_message(draft.case_file(), *request.mutable_case_()))
    throw Refusal(Refused::invalid_case, "the case that the checkpoint carries cannot be read");
  if (!head.spec().has_ranks()) {
    const auto executors = capacities();
    const auto executor = executors.find(head.spec().executor());
    request.mutable_spec()->set_ranks(executor == executors.end() ? 1 : std::min(report.ranks(), executor->second.most_ranks));
  }
  require_sound(request, capacities());
  JobRecord record;
  record.job.set_owner(caller.owner);
  record.job.set_id(draft.root().filename());
  record.job.set_state(v1::STATE_SUSPENDED);
  record.job.set_message("imported at step " + std::to_string(report.step()) + "; resume it, or start others from it");
  *record.job.mutable_spec() = request.spec();
  keep_plan(record.job, planner_.plan(case_text(request.case_()), request.spec().ranks()));
  return commit(record, request, "import " + std::to_string(head.bytes()) + " " + std::to_string(crc), &draft).job();
}

}  // namespace bedflow::server
