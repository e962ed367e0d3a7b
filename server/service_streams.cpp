// The calls that stream: statistics as they grow, fields, checkpoints out and in.
#include "case_file.h"
#include "download.h"
#include "import.h"
#include "pull_stream.h"
#include "security.h"
#include "service.h"

namespace bedflow::server {

template <class Response, class Source>
grpc::ServerWriteReactor<Response>* JobService::stream(Context* context, Pace pace, Source source) {
  last_call_ = std::chrono::steady_clock::now();
  ++calls_;
  // Of the caller once, when the first answer is drawn; from then on it is only asked whether the token still holds.
  auto draw = [this, context, source = std::move(source), caller = std::optional<Caller>()](Response& response) mutable {
    if (!caller) caller = door_.caller(*context);
    caller->require_still_good();
    return source(*caller, response);
  };
  return PullStream<Response>::open(pool(pace), context, std::move(draw), status_of_failure, [this] {
    last_call_ = std::chrono::steady_clock::now();
    --calls_;
  });
}

grpc::ServerWriteReactor<v1::StreamStatisticsResponse>* JobService::StreamStatistics(Context* context,
                                                                                     const v1::StreamStatisticsRequest* request) {
  using Clock = std::chrono::steady_clock;
  struct State {
    std::unique_ptr<StatisticsFollower> follower;
    Clock::time_point last{};
  };
  return stream<v1::StreamStatisticsResponse>(
      context, Pace::slow,
      [this, request = *request, state = std::make_shared<State>()](const Caller&, v1::StreamStatisticsResponse& response) {
        constexpr auto longest_silence = std::chrono::seconds(10);
        if (draining_) {
          throw Refusal(Refused::going_down, "the server is going down, the job is not; ask again with after_record");
        }
        const auto job = jobs_.get(request.id());  // before the look: after a final state nothing comes
        const bool first = !state->follower;
        if (first) state->follower = std::make_unique<StatisticsFollower>(jobs_.folder(request.id()), request);
        const bool has_news = state->follower->next(response);
        const bool ended = is_final(job.state()) || job.state() == v1::STATE_SUSPENDED;
        if (!has_news && !first && ended) return Pulled::end;
        if (!has_news && !first && Clock::now() - state->last < longest_silence) return Pulled::nothing_yet;
        response.set_bookmark(!has_news);
        state->last = Clock::now();
        return Pulled::answer;
      });
}

grpc::ServerWriteReactor<v1::DownloadCheckpointResponse>* JobService::DownloadCheckpoint(
    Context* context, const v1::DownloadCheckpointRequest* request) {
  return stream<v1::DownloadCheckpointResponse>(context, Pace::slow,
                                                [this, request = *request, file = std::shared_ptr<Download>()](
                                                    const Caller&, v1::DownloadCheckpointResponse& part) mutable {
                                                  if (!file)
                                                    file =
                                                        std::make_shared<Download>(jobs_.folder(request.name().job()), request);
                                                  return file->next(part) ? Pulled::answer : Pulled::end;
                                                });
}

grpc::ServerWriteReactor<v1::FieldAnswer>* JobService::QueryField(Context* context, const v1::QueryFieldRequest* request) {
  const auto begin = [this, context](const Caller& caller, const v1::QueryFieldRequest& asked, v1::FieldAnswer& header) {
    constexpr std::size_t longest = 16 << 10;
    if (asked.query().ByteSizeLong() > longest) throw Refusal(Refused::bad_request, "the question is longer than 16 KiB");
    v1::CheckpointName name = asked.name();
    const JobFolder folder = jobs_.folder(name.job());
    if (asked.fresh()) {
      if (name.has_step())
        throw Refusal(Refused::bad_request, "a fresh checkpoint has no step yet: ask for a step or for a fresh one");
      const std::chrono::duration<double> given = context->deadline() - std::chrono::system_clock::now();
      name.set_step(jobs_.create_checkpoint(caller, name.job(), std::min(std::chrono::duration<double>(60), given)).step());
    }
    std::shared_ptr<Readers::Answering> answering;
    with_checkpoint(folder, name, [&](std::uint64_t, const std::filesystem::path& file) {
      answering = readers_.ask(file, asked.query());
      auto first = answering->next();
      if (!first || !first->has_header()) throw Refusal(Refused::reader_failed, "the reader's answer has no head");
      header = std::move(*first);
      header.mutable_header()->set_job(name.job());
    });
    return answering;
  };
  return stream<v1::FieldAnswer>(context, Pace::reading,
                                 [begin, request = *request, answering = std::shared_ptr<Readers::Answering>()](
                                     const Caller& caller, v1::FieldAnswer& part) mutable {
                                   if (!answering) {
                                     answering = begin(caller, request, part);
                                     return Pulled::answer;
                                   }
                                   auto next = answering->next();
                                   if (!next) return Pulled::end;
                                   part = std::move(*next);
                                   return Pulled::answer;
                                 });
}

grpc::ServerReadReactor<v1::ImportCheckpointRequest>* JobService::ImportCheckpoint(Context* context, v1::Job* response) {
  last_call_ = std::chrono::steady_clock::now();
  ++calls_;
  return open_import(jobs_, readers_, door_, slow_, context, response, [this] {
    last_call_ = std::chrono::steady_clock::now();
    --calls_;
  });
}

}  // namespace bedflow::server
