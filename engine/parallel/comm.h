// The ranks of a run and what they say to each other. One type; with one rank nothing of MPI is called. The only mpi.h is in
// comm.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace bedflow {

// Starts MPI for the life of main() in a process that mpirun (or srun) launched; errors of MPI end all ranks.
class MpiSession {
 public:
  MpiSession(int* argc, char*** argv);
  ~MpiSession();
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;
};

// What a rank has said to others since its Comm was made.
struct Traffic {
  std::uint64_t messages = 0, bytes = 0;  // to one other rank
  std::uint64_t collectives = 0;          // reductions, broadcasts, gathers, exchanges of all with all
  double seconds = 0;                     // sending, receiving, waiting

  Traffic& operator+=(const Traffic& b) {
    messages += b.messages, bytes += b.bytes, collectives += b.collectives, seconds += b.seconds;
    return *this;
  }
  friend Traffic operator-(const Traffic& a, const Traffic& b) {
    return {a.messages - b.messages, a.bytes - b.bytes, a.collectives - b.collectives, a.seconds - b.seconds};
  }
};

class Comm {
 public:
  static Comm world();
  static Comm self();

  int rank() const { return rank_; }
  int size() const { return size_; }
  bool root() const { return rank_ == 0; }

  // Reductions over all ranks; every rank gets the same bits.
  double sum(double value) const;
  std::int64_t sum(std::int64_t value) const;
  double max(double value) const;
  std::int64_t max(std::int64_t value) const;
  double min(double value) const;
  bool any(bool value) const;
  void sum(std::span<double> values) const;  // element by element, in place
  // A maximum over all ranks that is under way while exchanges pass. One at a time.
  void begin_max(std::int64_t value) const;
  std::int64_t end_max() const;

  // Sum over the ranks below this one; 0 on rank 0.
  std::int64_t sum_before(std::int64_t value) const;

  void broadcast(std::span<std::byte> bytes, int from = 0) const;
  std::string broadcast(const std::string& text, int from = 0) const;

  // Every rank's values one after another in rank order, on rank 0 (empty elsewhere) and on all ranks.
  std::vector<std::byte> gather(std::span<const std::byte> mine) const;
  std::vector<std::int64_t> gather_all(std::int64_t mine) const;
  std::vector<double> gather_all(std::span<const double> mine) const;  // any length on each rank

  // Sends one message and receives one of any length. rank -1: nobody there, nothing sent or received.
  // To and from itself it copies.
  void exchange(int to, std::span<const double> send, int from, std::vector<double>& receive) const;
  // With the ranks on both sides at once, where lengths are known: send[s] goes to neighbours[s], and receive[s], as long as what
  // comes, is filled from there. -1: nobody. Both may be the same rank: what is sent towards one side comes from the other.
  template <class T>
  void exchange(std::array<int, 2> neighbours, const std::array<std::vector<T>, 2>& send,
                std::array<std::vector<T>, 2>& receive) const {
    exchange_bytes(neighbours, {std::as_bytes(std::span(send[0])), std::as_bytes(std::span(send[1]))},
                   {std::as_writable_bytes(std::span(receive[0])), std::as_writable_bytes(std::span(receive[1]))});
  }
  // Sends messages[r] to each rank r and returns what each rank sent here, in rank order.
  std::vector<std::vector<double>> exchange_all(const std::vector<std::vector<double>>& messages) const;

  void barrier() const;
  int machines() const;     // on which the ranks run; collective
  Traffic traffic() const;  // of all copies of this Comm together; nothing with one rank
  [[noreturn]] void abort(int exit_code) const;

 private:
  struct Handle;
  Comm(std::shared_ptr<Handle> handle, int rank, int size);
  void exchange_bytes(std::array<int, 2> neighbours, std::array<std::span<const std::byte>, 2> send,
                      std::array<std::span<std::byte>, 2> receive) const;
  std::shared_ptr<Handle> handle_;
  int rank_ = 0;
  int size_ = 1;
};

}  // namespace bedflow
