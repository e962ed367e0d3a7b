#include "particles/walls.h"

#include <algorithm>
#include <cmath>
#include <compare>

namespace bedflow {

namespace {

constexpr double same_contact = 0.8660254037844386;  // cos 30°: the least that normals of one contact have in common

// Keys of ContactHistory: behind the faces of the box, the wall and its normal, to a thousandth, in one number.
constexpr int bits = 11;
constexpr double steps = 1023;

std::int64_t key_of(std::size_t wall, Vec3 normal) {
  auto key = static_cast<std::int64_t>(wall);
  for (int d = 0; d < 3; ++d) key = key << bits | static_cast<std::int64_t>(std::lround((normal[d] + 1) * steps));
  return 6 + key;
}
std::size_t wall_of(std::int64_t key) {
  return static_cast<std::size_t>((key - 6) >> 3 * bits);
}
Vec3 normal_of(std::int64_t key) {
  Vec3 normal;
  for (int d = 0; d < 3; ++d) normal[d] = static_cast<double>(((key - 6) >> (2 - d) * bits) & ((1 << bits) - 1)) / steps - 1;
  return normal;
}

bool remembers(const MemoryRow& row, double now) {
  return row.touched == now;
}

}  // namespace

Walls::Walls(std::vector<Wall> walls, Vec3 box_size, double reach) {
  for (Wall& wall : walls) {
    Bounds bounds = std::visit([](const auto& shape) { return shape.bounds(); }, wall.surface);
    for (int d = 0; d < 3; ++d) {
      if (!std::isfinite(bounds.low[d])) bounds.low[d] = -reach;
      if (!std::isfinite(bounds.high[d])) bounds.high[d] = box_size[d] + reach;
    }
    const Rotation* rotation = std::get_if<Rotation>(&wall.motion);
    const bool slides = slides_along_itself(wall.surface, wall.motion), moves = !std::holds_alternative<Still>(wall.motion);
    parts_.push_back({std::move(wall), bounds, rotation ? rotation->point : Vec3{}, slides, moves});
  }
}

void Walls::place(Part& part, std::optional<double> time) const {
  if (!part.moves) return;
  part.pose = part.wall.pose(time.value_or(0));
  if (!time) part.pose.velocity = part.pose.spin = {};
  if (!part.slides) part.frame = part.pose;
}

void Walls::list(Part& part, const DemSetup& setup, const ParticleStore& particles, std::span<const Vec3> places) {
  const double extra = setup.range + (part.moves && !part.slides ? setup.skin : 0.5 * setup.skin);
  part.near.clear();
  part.facets.clear();
  const auto add = [&](const auto& shape) {
    for (std::uint32_t i = 0; i < places.size(); ++i) {
      const Vec3 x = part.frame.to_body(places[i]);
      const double reach = radius_of(setup.types, particles, i) + extra;
      const auto first = static_cast<std::uint32_t>(part.facets.size());
      if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, Mesh>) {
        if (!shape.near(x, reach, part.facets)) continue;
      } else {
        touches_.clear();
        shape.touch(x, reach, touches_);
        if (touches_.empty() && !shape.passed(x)) continue;
      }
      part.near.push_back({i, first, static_cast<std::uint32_t>(part.facets.size())});
    }
  };
  std::visit(add, part.wall.surface);
}

void Walls::meet(const DemSetup& setup, const ParticleStore& particles, std::span<const Vec3> places, std::optional<double> time,
                 double now) {
  met_.swap(before_);
  met_.clear();
  behind_ = 0;
  passed_ = false;
  for (std::size_t w = 0; w < parts_.size(); ++w) {
    Part& part = parts_[w];
    place(part, time);
    const double at = time.value_or(0);
    const double moved = part.moves && !part.slides ? farthest_move(part.wall.motion, part.listed_at, at, part.bounds) : 0;
    if (!listed_ || moved > 0.5 * setup.skin) {
      list(part, setup, particles, places);
      part.listed_at = at;
    }
    std::visit([&](const auto& shape) { meet_part(shape, w, setup, particles, now); }, part.wall.surface);
  }
  listed_ = true;
}

template <class Shape>
void Walls::meet_part(const Shape& shape, std::size_t index, const DemSetup& setup, const ParticleStore& particles, double now) {
  const Part& part = parts_[index];
  for (const Near& near : part.near) {
    const std::uint32_t i = near.particle;
    const Vec3 x = particles.position(i), body = part.frame.to_body(x);
    const double radius = radius_of(setup.types, particles, i);
    double rise = smooth_rise;
    touches_.clear();
    if constexpr (std::is_same_v<Shape, Mesh>) {
      shape.touch(body, radius + setup.range, std::span(part.facets).subspan(near.first, near.last - near.first), touches_);
      rise = shape.rise();
    } else {
      shape.touch(body, radius + setup.range, touches_);
      passed_ |= shape.passed(body);
    }
    for (const Touch& touch : touches_.contacts(rise)) {
      const Vec3 n = -part.frame.turned(touch.normal), at = x + touch.distance * n;
      const Vec3 wall_velocity = part.pose.velocity_at(at), velocity = particles.velocity(i) - wall_velocity;
      const std::size_t type = particles.type.empty() ? 0 : particles.type[i];
      const double overlap = radius - touch.distance;
      met_.push_back({{i,
                       (1 + index) * setup.types.size() + type,
                       n,
                       touch.distance,
                       radius,
                       velocity,
                       part.pose.spin,
                       {overlap, dot(velocity, n), setup.types[type].mass_of(radius), radius},
                       at - part.reference,
                       nullptr,
                       nullptr,
                       nullptr,
                       nullptr,
                       wall_velocity},
                      static_cast<std::uint32_t>(index),
                      {},
                      {}});
      if (overlap > 0) recall(met_.back(), now);
    }
  }
}

// Takes the memory of the contact of the sub-step before whose normal was nearest.
void Walls::recall(Meeting& meeting, double now) {
  const auto mine = [&](const Meeting& other) {
    return std::pair(other.wall, other.contact.particle) <=> std::pair(meeting.wall, meeting.contact.particle);
  };
  while (behind_ < before_.size() && std::is_lt(mine(before_[behind_]))) ++behind_;
  double nearest = same_contact;
  const Meeting* found = nullptr;
  for (std::size_t b = behind_; b < before_.size() && std::is_eq(mine(before_[b])); ++b) {
    const double common = dot(before_[b].contact.n, meeting.contact.n);
    if (common <= nearest || !(remembers(before_[b].displacement, now - 1) || remembers(before_[b].angle, now - 1))) continue;
    nearest = common;
    found = &before_[b];
  }
  if (!found) return;
  meeting.displacement = found->displacement;
  meeting.angle = found->angle;
}

const std::string* Walls::passed(Vec3 place) const {
  if (!listed_) return nullptr;
  for (const Part& part : parts_) {
    const Vec3 body = part.frame.to_body(place);
    if (std::visit([&](const auto& shape) { return shape.passed(body); }, part.wall.surface)) return &part.wall.name;
  }
  return nullptr;
}

// ---------------------------------------------------------------------------------------------------- memory

namespace {

template <class Meeting>
ContactMemory memory_of(const Meeting& meeting) {
  return {meeting.displacement.value, meeting.angle.value};
}

}  // namespace

void Walls::save(double now, ContactHistory& history) const {
  for (const Meeting& meeting : met_) {
    if (!remembers(meeting.displacement, now) && !remembers(meeting.angle, now)) continue;
    history.add(meeting.contact.particle, ContactHistory::wall_contact(key_of(meeting.wall, meeting.contact.n)),
                memory_of(meeting));
  }
}

void Walls::load(double now, const ContactHistory& history, std::size_t particles) {
  met_.clear();
  listed_ = false;
  if (parts_.empty()) return;
  for (std::uint32_t i = 0; i < particles; ++i)
    history.for_each(i, [&](const ContactHistory::Contact& contact) {
      const std::int64_t key = ContactHistory::wall_of(contact.other);
      if (contact.other >= 0 || key < 6 || wall_of(key) >= parts_.size()) return;
      Meeting meeting{};
      meeting.contact.particle = i;
      meeting.contact.n = normal_of(key);
      meeting.wall = static_cast<std::uint32_t>(wall_of(key));
      meeting.displacement = {contact.memory.displacement, now};
      meeting.angle = {contact.memory.angle, now};
      met_.push_back(meeting);
    });
  std::sort(met_.begin(), met_.end(), [](const Meeting& a, const Meeting& b) {
    return std::pair(a.wall, a.contact.particle) < std::pair(b.wall, b.contact.particle);
  });
}

std::vector<WallHistory> Walls::histories(const ParticleStore& particles, double now) const {
  std::vector<WallHistory> result;
  for (const Meeting& meeting : met_)
    if (remembers(meeting.displacement, now) || remembers(meeting.angle, now))
      result.push_back({particles.id[meeting.contact.particle], key_of(meeting.wall, meeting.contact.n), memory_of(meeting)});
  return result;
}

}  // namespace bedflow
