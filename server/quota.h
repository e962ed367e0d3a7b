// How much of the server an owner, or all of them together, may have. What is absent has no limit.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"

namespace bedflow::server {

class Quotas {
 public:
  Quotas() = default;
  // "each:jobs=100,running=4,disk=50GiB" for each owner, "all:…" for all together, "owner/NAME:…" for one instead of "each".
  // Throws std::invalid_argument with the word that is wrong and what it may be.
  explicit Quotas(const std::vector<std::string>& texts);

  const v1::Quota& all() const { return all_; }
  const v1::Quota& of(const std::string& owner) const;
  bool any() const { return any_; }

 private:
  v1::Quota all_, each_;
  std::map<std::string, v1::Quota> owners_;
  bool any_ = false;
};

// What an owner has now, or all together.
struct Holding {
  std::uint64_t jobs = 0, bytes = 0;
};

// Throws Refusal(quota) when one more job is too many: names the quota, what there is, and the limit. whose: "owner anna" or
// "all owners together".
void require_room(const v1::Quota& quota, const Holding& now, const std::string& whose);
// Why one more may not run now; empty: it may.
std::string why_not_run(const v1::Quota& quota, std::uint64_t running, const std::string& whose);

}  // namespace bedflow::server
