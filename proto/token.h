// The text of a token, bedflow_<id>_<secret>, and what may be kept of it. The id is no secret; the secret has 256 random bits, so
// its SHA-256 cannot be guessed back, and needs no salt.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace bedflow {

struct TokenText {
  std::string id;      // 12 hex digits
  std::string secret;  // 64 hex digits

  std::string text() const { return "bedflow_" + id + "_" + secret; }
};

TokenText new_token();                                       // of the system's random numbers; throws std::system_error
std::optional<TokenText> read_token(std::string_view text);  // nothing unless it is of that form to the letter
bool is_token_id(std::string_view id);

std::string sha256(std::string_view bytes);                 // 32 bytes
bool is_same_hash(std::string_view a, std::string_view b);  // of 32 bytes each, in a time that does not tell where they differ

}  // namespace bedflow
