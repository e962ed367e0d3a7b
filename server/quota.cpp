#include "quota.h"

#include <charconv>
#include <stdexcept>

#include "refusal.h"
#include "security.h"
#include "size_text.h"

namespace bedflow::server {
namespace {

constexpr const char* form = "; a quota is each:, all: or owner/NAME: and then jobs=N, running=N, disk=SIZE with commas between";

std::uint32_t count_of_text(const std::string& text, const std::string& whole) {
  std::uint32_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc() || end != text.data() + text.size())
    throw std::invalid_argument("'" + text + "' in the quota '" + whole + "' is no whole number" + form);
  return count;
}

void set(v1::Quota& quota, const std::string& word, const std::string& whole) {
  const auto equals = word.find('=');
  const std::string name = word.substr(0, equals), value = equals == word.npos ? "" : word.substr(equals + 1);
  if (name == "jobs") return quota.set_jobs(count_of_text(value, whole));
  if (name == "running") return quota.set_running(count_of_text(value, whole));
  if (name == "disk") return quota.set_bytes(bytes_of_text(value));
  throw std::invalid_argument("'" + word + "' in the quota '" + whole + "' is unknown" + form);
}

}  // namespace

Quotas::Quotas(const std::vector<std::string>& texts) : any_(!texts.empty()) {
  for (const auto& text : texts) {
    const auto colon = text.find(':');
    const std::string whose = text.substr(0, colon);
    const bool is_owner = whose.starts_with("owner/") && whose.size() > 6;
    if (colon == text.npos || (whose != "each" && whose != "all" && !is_owner))
      throw std::invalid_argument("'" + text + "' is no quota" + form);
    v1::Quota& quota = whose == "each" ? each_ : whose == "all" ? all_ : owners_[whose.substr(6)];
    for (std::size_t start = colon + 1; start <= text.size();) {
      const auto comma = std::min(text.find(',', start), text.size());
      set(quota, text.substr(start, comma - start), text);
      start = comma + 1;
    }
  }
}

const v1::Quota& Quotas::of(const std::string& owner) const {
  const auto own = owners_.find(owner);
  return own == owners_.end() ? each_ : own->second;
}

void require_room(const v1::Quota& quota, const Holding& now, const std::string& whose) {
  if (quota.has_jobs() && now.jobs >= quota.jobs()) {
    throw Refusal(Refused::quota,
                  whose + " may keep " + std::to_string(quota.jobs()) + " jobs, and " + std::to_string(now.jobs) + " are there",
                  "bedflow server usage; bedflow delete JOB");
  }
  if (quota.has_bytes() && now.bytes >= quota.bytes()) {
    throw Refusal(Refused::quota,
                  whose + " may fill " + bytes_text(quota.bytes()) + " of the disk, and the jobs take " + bytes_text(now.bytes),
                  "bedflow server usage; bedflow delete JOB");
  }
}

std::string why_not_run(const v1::Quota& quota, std::uint64_t running, const std::string& whose) {
  if (!quota.has_running() || running < quota.running()) return {};
  return "the quota of running jobs: " + whose + " may run " + std::to_string(quota.running()) + " at once, and " +
         std::to_string(running) + (running == 1 ? " runs" : " run");
}

}  // namespace bedflow::server
