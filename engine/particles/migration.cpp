#include "particles/migration.h"

#include <bit>
#include <unordered_map>
#include <unordered_set>

namespace bedflow {

namespace {

using Message = std::vector<double>;

double packed(std::int64_t value) {
  return std::bit_cast<double>(value);
}

void put(Message& message, Vec3 v) {
  message.insert(message.end(), {v.x, v.y, v.z});
}

// Reads a message from its front.
class Reader {
 public:
  explicit Reader(const Message& message) : next_(message.data()), end_(next_ + message.size()) {}
  explicit operator bool() const { return next_ != end_; }
  double number() { return *next_++; }
  std::int64_t integer() { return std::bit_cast<std::int64_t>(number()); }
  Vec3 vector() {
    next_ += 3;
    return {next_[-3], next_[-2], next_[-1]};
  }

 private:
  const double* next_;
  const double* end_;
};

void put_particle(Message& message, const ParticleStore& store, std::size_t i, GasForce gas) {
  message.push_back(packed(store.id[i]));
  put(message, store.position(i));
  put(message, store.velocity(i));
  put(message, store.spin(i));
  if (gas != GasForce::none) put(message, store.gas_force[i]);
  if (gas == GasForce::relaxed) {
    message.insert(message.end(), {store.gas_response[i].drag, store.gas_response[i].share});
    put(message, store.gas_response[i].debt);
  }
}

void take_particle(Reader& reader, ParticleStore& store, GasForce gas) {
  const std::int64_t id = reader.integer();
  const Vec3 position = reader.vector(), velocity = reader.vector(), spin = reader.vector();
  store.add(id, position, velocity, spin);
  if (gas != GasForce::none) store.gas_force.push_back(reader.vector());
  if (gas == GasForce::relaxed) {
    const double drag = reader.number(), share = reader.number();
    store.gas_response.push_back({drag, share, reader.vector()});
  }
}

void move_particle(ParticleStore& store, std::size_t from, std::size_t to, GasForce gas) {
  store.rows[to] = store.rows[from];
  store.spin_z[to] = store.spin_z[from];
  store.id[to] = store.id[from];
  if (gas != GasForce::none) store.gas_force[to] = store.gas_force[from];
  if (gas == GasForce::relaxed) store.gas_response[to] = store.gas_response[from];
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
void take_leaving(const Stage& stage, ParticleStore& store, ContactHistory& history, GasForce gas, Message& message) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < store.id.size(); ++i) {
    if (!stage.leaves(store.position(i))) {
      move_particle(store, i, kept, gas);
      history.heads()[kept++] = history.heads()[i];
      continue;
    }
    store.position(i) = stage.arrival(store.position(i));
    put_particle(message, store, i, gas);
    const std::size_t length_at = message.size();
    message.push_back(0);
    std::int64_t contacts = 0;
    history.for_each(i, [&](const ContactHistory::Contact& contact) {
      message.push_back(packed(contact.other));
      put(message, contact.displacement);
      ++contacts;
    });
    message[length_at] = packed(contacts);
  }
  store.resize(kept);
  if (gas != GasForce::none) store.gas_force.resize(kept);
  if (gas == GasForce::relaxed) store.gas_response.resize(kept);
  history.heads().resize(kept);
}

void append(const Message& message, ParticleStore& store, ContactHistory& history, GasForce gas) {
  for (Reader reader(message); reader;) {
    take_particle(reader, store, gas);
    const std::size_t row = history.append_particle();
    for (std::int64_t contacts = reader.integer(); contacts > 0; --contacts) {
      const std::int64_t other = reader.integer();
      history.add(row, other, reader.vector());
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
      if (to >= 0) take_leaving(Stage(decomposition, d, side), particles, history, setup.gas, send);
      comm.exchange(to, send, from, receive);
      append(receive, particles, history, setup.gas);
    }
  particles.owned = particles.rows.size();
}

ParticleStore redistribute(const Decomposition& decomposition, const ParticleStore& particles) {
  const Comm& comm = decomposition.comm();
  const auto any_has = [&](const auto& rows) { return comm.any(!rows.empty()); };  // an empty rank cannot tell
  const GasForce gas = any_has(particles.gas_response) ? GasForce::relaxed
                       : any_has(particles.gas_force)  ? GasForce::frozen
                                                       : GasForce::none;
  std::vector<Message> messages(comm.size());
  for (std::size_t i = 0; i < particles.owned; ++i)
    put_particle(messages[decomposition.owner(particles.position(i))], particles, i, gas);
  ParticleStore result;
  for (const Message& message : comm.exchange_all(messages))
    for (Reader reader(message); reader;) take_particle(reader, result, gas);
  return result;
}

// By way of a directory: rank id mod ranks knows who owns the particle id.
void redistribute(const Comm& comm, const std::vector<std::int64_t>& ids, std::vector<PairHistory>& pairs,
                  std::vector<WallHistory>& walls) {
  const auto clerk = [&](std::int64_t id) { return static_cast<std::size_t>(id % comm.size()); };
  const auto write = [](Message& message, std::int64_t key, std::int64_t first, std::int64_t second, Vec3 displacement) {
    message.insert(message.end(), {packed(key), packed(first), packed(second)});
    put(message, displacement);
  };
  std::vector<Message> owned(comm.size()), sent(comm.size()), forwarded(comm.size());
  for (const std::int64_t id : ids) owned[clerk(id)].push_back(packed(id));
  for (const PairHistory& pair : pairs) {
    write(sent[clerk(pair.low)], pair.low, pair.low, pair.high, pair.displacement);
    write(sent[clerk(pair.high)], pair.high, pair.low, pair.high, pair.displacement);
  }
  for (const WallHistory& wall : walls)
    write(sent[clerk(wall.id)], wall.id, wall.id, ContactHistory::wall_contact(wall.wall), wall.displacement);

  std::unordered_map<std::int64_t, int> owner;
  const auto registered = comm.exchange_all(owned);
  for (int rank = 0; rank < comm.size(); ++rank)
    for (Reader reader(registered[rank]); reader;) owner[reader.integer()] = rank;
  for (const Message& message : comm.exchange_all(sent))
    for (Reader reader(message); reader;) {
      const std::int64_t key = reader.integer(), first = reader.integer(), second = reader.integer();
      const Vec3 displacement = reader.vector();
      if (const auto found = owner.find(key); found != owner.end())
        write(forwarded[found->second], key, first, second, displacement);
    }
  pairs.clear();
  walls.clear();
  std::unordered_set<std::int64_t> mine(ids.begin(), ids.end());
  for (const Message& message : comm.exchange_all(forwarded))
    for (Reader reader(message); reader;) {
      const std::int64_t key = reader.integer(), first = reader.integer(), second = reader.integer();
      const Vec3 displacement = reader.vector();
      if (second < 0) {
        walls.push_back({first, ContactHistory::wall_of(second), displacement});
      } else if (key == first || !mine.contains(first)) {  // a pair of two owned particles comes twice
        pairs.push_back({first, second, displacement});
      }
    }
}

}  // namespace bedflow
