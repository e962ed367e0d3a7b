#include "parallel/comm.h"

#define OMPI_SKIP_MPICXX 1  // the C interface alone
#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <numeric>

namespace bedflow {

struct Comm::Handle {
  MPI_Comm comm = MPI_COMM_SELF;
  Traffic traffic{};
  std::int64_t pending = 0;  // the value of a maximum under way
  MPI_Request request = MPI_REQUEST_NULL;
};

namespace {

constexpr int tag = 1;
constexpr std::array<int, 2> towards = {2, 3};  // tags of what is sent to one side and the other

// Counts what MPI takes while it lives.
class Counted {
 public:
  explicit Counted(Traffic& traffic) : traffic_(traffic) {}
  ~Counted() { traffic_.seconds += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  Traffic& traffic_;
  Clock::time_point start_ = Clock::now();
};

Counted collective(Traffic& traffic) {
  ++traffic.collectives;
  return Counted(traffic);
}
Counted message(Traffic& traffic, int to, std::size_t bytes) {
  if (to >= 0) ++traffic.messages, traffic.bytes += bytes;
  return Counted(traffic);
}

template <class T, class Handle>
T reduce(T value, MPI_Datatype type, MPI_Op op, Handle& handle) {
  const Counted counted = collective(handle.traffic);
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, type, op, handle.comm);
  return value;
}

std::vector<int> offsets_of(const std::vector<int>& counts) {
  std::vector<int> offsets(counts.size(), 0);
  std::partial_sum(counts.begin(), counts.end() - 1, offsets.begin() + 1);
  return offsets;
}

}  // namespace

// A process that no launcher started has nobody to talk to: MPI stays asleep, which saves it a helper process and a start.
MpiSession::MpiSession(int* argc, char*** argv) {
  const bool launched = std::getenv("OMPI_COMM_WORLD_SIZE") || std::getenv("PMIX_RANK") || std::getenv("PMI_RANK");
  if (launched) MPI_Init(argc, argv);
}
MpiSession::~MpiSession() {
  int started = 0;
  MPI_Initialized(&started);
  if (started) MPI_Finalize();
}

Comm::Comm(std::shared_ptr<Handle> handle, int rank, int size) : handle_(std::move(handle)), rank_(rank), size_(size) {}
Comm Comm::world() {
  int started = 0, rank = 0, size = 1;
  MPI_Initialized(&started);
  if (!started) return self();
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return {std::make_shared<Handle>(Handle{.comm = MPI_COMM_WORLD}), rank, size};
}
Comm Comm::self() {
  return {std::make_shared<Handle>(), 0, 1};
}

double Comm::sum(double value) const {
  return size_ == 1 ? value : reduce(value, MPI_DOUBLE, MPI_SUM, *handle_);
}
std::int64_t Comm::sum(std::int64_t value) const {
  return size_ == 1 ? value : reduce(value, MPI_INT64_T, MPI_SUM, *handle_);
}
double Comm::max(double value) const {
  return size_ == 1 ? value : reduce(value, MPI_DOUBLE, MPI_MAX, *handle_);
}
std::int64_t Comm::max(std::int64_t value) const {
  return size_ == 1 ? value : reduce(value, MPI_INT64_T, MPI_MAX, *handle_);
}
double Comm::min(double value) const {
  return size_ == 1 ? value : reduce(value, MPI_DOUBLE, MPI_MIN, *handle_);
}
bool Comm::any(bool value) const {
  return max(static_cast<std::int64_t>(value)) != 0;
}
void Comm::sum(std::span<double> values) const {
  if (size_ == 1) return;
  const Counted counted = collective(handle_->traffic);
  MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_SUM, handle_->comm);
}

void Comm::begin_max(std::int64_t value) const {
  handle_->pending = value;
  if (size_ == 1) return;
  const Counted counted = collective(handle_->traffic);
  MPI_Iallreduce(MPI_IN_PLACE, &handle_->pending, 1, MPI_INT64_T, MPI_MAX, handle_->comm, &handle_->request);
}
std::int64_t Comm::end_max() const {
  if (size_ > 1) {
    const Counted counted(handle_->traffic);
    MPI_Wait(&handle_->request, MPI_STATUS_IGNORE);
  }
  return handle_->pending;
}

std::int64_t Comm::sum_before(std::int64_t value) const {
  if (size_ == 1) return 0;
  const Counted counted = collective(handle_->traffic);
  std::int64_t before = 0;
  MPI_Exscan(&value, &before, 1, MPI_INT64_T, MPI_SUM, handle_->comm);
  return rank_ == 0 ? 0 : before;
}

void Comm::broadcast(std::span<std::byte> bytes, int from) const {
  if (size_ == 1) return;
  const Counted counted = collective(handle_->traffic);
  MPI_Bcast(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, from, handle_->comm);
}
std::string Comm::broadcast(const std::string& text, int from) const {
  auto length = static_cast<std::int64_t>(text.size());
  broadcast(std::as_writable_bytes(std::span(&length, 1)), from);
  std::string result = text;
  result.resize(static_cast<std::size_t>(length));
  broadcast(std::as_writable_bytes(std::span(result)), from);
  return result;
}

std::vector<std::byte> Comm::gather(std::span<const std::byte> mine) const {
  if (size_ == 1) return {mine.begin(), mine.end()};
  const Counted counted = collective(handle_->traffic);
  int count = static_cast<int>(mine.size());
  std::vector<int> counts(root() ? size_ : 0);
  MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, handle_->comm);
  std::vector<int> offsets;
  std::vector<std::byte> all;
  if (root()) {
    offsets = offsets_of(counts);
    all.resize(static_cast<std::size_t>(offsets.back() + counts.back()));
  }
  MPI_Gatherv(mine.data(), count, MPI_BYTE, all.data(), counts.data(), offsets.data(), MPI_BYTE, 0, handle_->comm);
  return all;
}
std::vector<std::int64_t> Comm::gather_all(std::int64_t mine) const {
  if (size_ == 1) return {mine};
  const Counted counted = collective(handle_->traffic);
  std::vector<std::int64_t> all(size_);
  MPI_Allgather(&mine, 1, MPI_INT64_T, all.data(), 1, MPI_INT64_T, handle_->comm);
  return all;
}
std::vector<double> Comm::gather_all(std::span<const double> mine) const {
  if (size_ == 1) return {mine.begin(), mine.end()};
  const Counted counted = collective(handle_->traffic);
  const int count = static_cast<int>(mine.size());
  std::vector<int> counts(size_);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, handle_->comm);
  const std::vector<int> offsets = offsets_of(counts);
  std::vector<double> all(static_cast<std::size_t>(offsets.back() + counts.back()));
  MPI_Allgatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), offsets.data(), MPI_DOUBLE, handle_->comm);
  return all;
}

void Comm::exchange(int to, std::span<const double> send, int from, std::vector<double>& receive) const {
  if (to == rank_ && from == rank_) {
    receive.assign(send.begin(), send.end());
    return;
  }
  if (size_ == 1) return receive.clear();
  const Counted counted = message(handle_->traffic, to, send.size_bytes());
  MPI_Request request = MPI_REQUEST_NULL;
  if (to >= 0) MPI_Isend(send.data(), static_cast<int>(send.size()), MPI_DOUBLE, to, tag, handle_->comm, &request);
  receive.clear();
  if (from >= 0) {
    MPI_Status status;
    MPI_Probe(from, tag, handle_->comm, &status);
    int count = 0;
    MPI_Get_count(&status, MPI_DOUBLE, &count);
    receive.resize(static_cast<std::size_t>(count));
    MPI_Recv(receive.data(), count, MPI_DOUBLE, from, tag, handle_->comm, MPI_STATUS_IGNORE);
  }
  MPI_Wait(&request, MPI_STATUS_IGNORE);
}
void Comm::exchange_bytes(std::array<int, 2> neighbours, std::array<std::span<const std::byte>, 2> send,
                          std::array<std::span<std::byte>, 2> receive) const {
  if (neighbours[0] == rank_) {  // and so is the other
    for (int side = 0; side < 2; ++side) std::copy(send[side].begin(), send[side].end(), receive[1 - side].begin());
    return;
  }
  if (size_ == 1) return;
  const Counted counted(handle_->traffic);
  std::array<MPI_Request, 4> requests;
  requests.fill(MPI_REQUEST_NULL);
  for (int side = 0; side < 2; ++side) {
    if (neighbours[side] < 0) continue;
    MPI_Irecv(receive[side].data(), static_cast<int>(receive[side].size()), MPI_BYTE, neighbours[side], towards[1 - side],
              handle_->comm, &requests[side]);
    ++handle_->traffic.messages, handle_->traffic.bytes += send[side].size();
    MPI_Isend(send[side].data(), static_cast<int>(send[side].size()), MPI_BYTE, neighbours[side], towards[side], handle_->comm,
              &requests[2 + side]);
  }
  MPI_Waitall(4, requests.data(), MPI_STATUSES_IGNORE);
}

std::vector<std::vector<double>> Comm::exchange_all(const std::vector<std::vector<double>>& messages) const {
  if (size_ == 1) return messages;
  const Counted counted = collective(handle_->traffic);
  std::vector<int> send_counts(size_), receive_counts(size_);
  std::vector<double> send, receive;
  for (int r = 0; r < size_; ++r) {
    send_counts[r] = static_cast<int>(messages[r].size());
    send.insert(send.end(), messages[r].begin(), messages[r].end());
  }
  MPI_Alltoall(send_counts.data(), 1, MPI_INT, receive_counts.data(), 1, MPI_INT, handle_->comm);
  const std::vector<int> send_offsets = offsets_of(send_counts), receive_offsets = offsets_of(receive_counts);
  receive.resize(static_cast<std::size_t>(receive_offsets.back() + receive_counts.back()));
  MPI_Alltoallv(send.data(), send_counts.data(), send_offsets.data(), MPI_DOUBLE, receive.data(), receive_counts.data(),
                receive_offsets.data(), MPI_DOUBLE, handle_->comm);
  std::vector<std::vector<double>> result(size_);
  for (int r = 0; r < size_; ++r) {
    const auto first = receive.begin() + receive_offsets[r];
    result[r].assign(first, first + receive_counts[r]);
  }
  return result;
}

void Comm::barrier() const {
  if (size_ == 1) return;
  const Counted counted = collective(handle_->traffic);
  MPI_Barrier(handle_->comm);
}
int Comm::machines() const {
  if (size_ == 1) return 1;
  const Counted counted = collective(handle_->traffic);
  MPI_Comm here = MPI_COMM_NULL;
  int rank_here = 0;
  MPI_Comm_split_type(handle_->comm, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &here);
  MPI_Comm_rank(here, &rank_here);
  MPI_Comm_free(&here);
  return static_cast<int>(sum(std::int64_t{rank_here == 0}));
}
Traffic Comm::traffic() const {
  return handle_->traffic;
}
void Comm::abort(int exit_code) const {
  if (size_ > 1) MPI_Abort(handle_->comm, exit_code);
  std::_Exit(exit_code);
}

}  // namespace bedflow
