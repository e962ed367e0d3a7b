#include "particles/migration.h"

#include <array>
#include <bit>
#include <unordered_map>
#include <unordered_set>

namespace bedflow {

namespace {

using Message = std::vector<double>;
constexpr std::size_t double_size = sizeof(double);

double packed(std::int64_t value) {
  return std::bit_cast<double>(value);
}

// Reads a message from its front.
class Reader {
 public:
  explicit Reader(const Message& message) : next_(message.data()), end_(next_ + message.size()) {}
  explicit operator bool() const { return next_ != end_; }
  double number() { return *next_++; }
  std::int64_t integer() { return std::bit_cast<std::int64_t>(number()); }
  template <class T>
  T element() {
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      return static_cast<std::uint8_t>(integer());
    } else {
      std::array<double, sizeof(T) / double_size> doubles;
      for (double& value : doubles) value = number();
      return std::bit_cast<T>(doubles);
    }
  }

 private:
  const double* next_;
  const double* end_;
};

// An element of one of the store's arrays.
void put_element(Message& message, std::uint8_t type) {
  message.push_back(packed(type));
}
template <class T>
void put_element(Message& message, const T& element) {
  const auto doubles = std::bit_cast<std::array<double, sizeof(T) / double_size>>(element);
  message.insert(message.end(), doubles.begin(), doubles.end());
}

void put_particle(Message& message, const DemSetup& setup, ParticleStore& store, std::size_t i) {
  store.each_array(setup, [&](auto& array) { put_element(message, array[i]); });
}
void take_particle(Reader& reader, const DemSetup& setup, ParticleStore& store) {
  store.each_array(setup, [&]<class T>(std::vector<T>& array) { array.push_back(reader.element<T>()); });
  store.owned = store.rows.size();
}

// One stage: out of the block on one side of one direction.
class Stage {
 public:
  Stage(const Decomposition& decomposition, int d, int side) : decomposition_(decomposition), d_(d), side_(side) {
    if (decomposition.wraps(d, side)) wrap_[d] = (side == 0 ? 1 : -1) * decomposition.size()[d];
  }
  bool leaves(Vec3 x) const { return side_ == 0 ? x[d_] < decomposition_.low()[d_] : x[d_] >= decomposition_.high()[d_]; }
  Vec3 arrival(Vec3 x) const { return x + wrap_; }

 private:
  const Decomposition& decomposition_;
  int d_, side_;
  Vec3 wrap_;
};

// Moves the rows that leave into the message and closes the gaps, in order.
void take_leaving(const Stage& stage, const DemSetup& setup, ParticleStore& store, ContactHistory& history, Message& message) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < store.id.size(); ++i) {
    if (!stage.leaves(store.position(i))) {
      store.each_array(setup, [&](auto& array) { array[kept] = array[i]; });
      history.heads()[kept++] = history.heads()[i];
      continue;
    }
    store.position(i) = stage.arrival(store.position(i));
    put_particle(message, setup, store, i);
    const std::size_t length_at = message.size();
    message.push_back(0);
    std::int64_t contacts = 0;
    history.for_each(i, [&](const ContactHistory::Contact& contact) {
      message.push_back(packed(contact.other));
      put_element(message, contact.memory);
      ++contacts;
    });
    message[length_at] = packed(contacts);
  }
  store.each_array(setup, [&](auto& array) { array.resize(kept); });
  history.heads().resize(kept);
}

void append(const Message& message, const DemSetup& setup, ParticleStore& store, ContactHistory& history) {
  for (Reader reader(message); reader;) {
    take_particle(reader, setup, store);
    const std::size_t row = history.append_particle();
    for (std::int64_t contacts = reader.integer(); contacts > 0; --contacts) {
      const std::int64_t other = reader.integer();
      history.add(row, other, reader.element<ContactMemory>());
    }
  }
}

}  // namespace

void migrate(const Decomposition& decomposition, const DemSetup& setup, ParticleStore& particles, ContactHistory& history) {
  const Comm& comm = decomposition.comm();
  Message send, receive;
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) {
      const int to = decomposition.neighbour(d, side), from = decomposition.neighbour(d, 1 - side);
      if (to < 0 && from < 0) continue;
      send.clear();
      if (to >= 0) take_leaving(Stage(decomposition, d, side), setup, particles, history, send);
      comm.exchange(to, send, from, receive);
      append(receive, setup, particles, history);
    }
  particles.owned = particles.rows.size();
}

ParticleStore redistribute(const Decomposition& decomposition, const DemSetup& setup, ParticleStore particles) {
  std::vector<Message> messages(decomposition.comm().size());
  for (std::size_t i = 0; i < particles.owned; ++i)
    put_particle(messages[decomposition.owner(particles.position(i))], setup, particles, i);
  ParticleStore result;
  for (const Message& message : decomposition.comm().exchange_all(messages))
    for (Reader reader(message); reader;) take_particle(reader, setup, result);
  return result;
}

// By way of a directory: rank id mod ranks knows who owns the particle id.
void redistribute(const Comm& comm, const std::vector<std::int64_t>& ids, std::vector<PairHistory>& pairs,
                  std::vector<WallHistory>& walls) {
  const auto clerk = [&](std::int64_t id) { return static_cast<std::size_t>(id % comm.size()); };
  const auto write = [](Message& message, std::int64_t key, std::int64_t first, std::int64_t second,
                        const ContactMemory& memory) {
    message.insert(message.end(), {packed(key), packed(first), packed(second)});
    put_element(message, memory);
  };
  std::vector<Message> owned(comm.size()), sent(comm.size()), forwarded(comm.size());
  for (const std::int64_t id : ids) owned[clerk(id)].push_back(packed(id));
  for (const PairHistory& pair : pairs) {
    write(sent[clerk(pair.low)], pair.low, pair.low, pair.high, pair.memory);
    write(sent[clerk(pair.high)], pair.high, pair.low, pair.high, pair.memory);
  }
  for (const WallHistory& wall : walls)
    write(sent[clerk(wall.id)], wall.id, wall.id, ContactHistory::wall_contact(wall.wall), wall.memory);

  std::unordered_map<std::int64_t, int> owner;
  const auto registered = comm.exchange_all(owned);
  for (int rank = 0; rank < comm.size(); ++rank)
    for (Reader reader(registered[rank]); reader;) owner[reader.integer()] = rank;
  for (const Message& message : comm.exchange_all(sent))
    for (Reader reader(message); reader;) {
      const std::int64_t key = reader.integer(), first = reader.integer(), second = reader.integer();
      const auto memory = reader.element<ContactMemory>();
      if (const auto found = owner.find(key); found != owner.end()) write(forwarded[found->second], key, first, second, memory);
    }
  pairs.clear();
  walls.clear();
  std::unordered_set<std::int64_t> mine(ids.begin(), ids.end());
  for (const Message& message : comm.exchange_all(forwarded))
    for (Reader reader(message); reader;) {
      const std::int64_t key = reader.integer(), first = reader.integer(), second = reader.integer();
      const auto memory = reader.element<ContactMemory>();
      if (second < 0) {
        walls.push_back({first, ContactHistory::wall_of(second), memory});
      } else if (key == first || !mine.contains(first)) {  // a pair of two owned particles comes twice
        pairs.push_back({first, second, memory});
      }
    }
}

}  // namespace bedflow
