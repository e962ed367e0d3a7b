#include "token.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <sys/random.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace bedflow {
namespace {

constexpr std::size_t id_digits = 12, secret_digits = 64, hash_bytes = 32;
constexpr std::string_view prefix = "bedflow_";

bool is_hex(std::string_view text, std::size_t digits) {
  return text.size() == digits && text.find_first_not_of("0123456789abcdef") == text.npos;
}

std::string random_hex(std::size_t digits) {
  std::string bytes(digits / 2, '\0');
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::system_error(errno, std::generic_category(), "getrandom");
  std::string hex;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    hex += {"0123456789abcdef"[byte >> 4], "0123456789abcdef"[byte & 15]};
  }
  return hex;
}

}  // namespace

TokenText new_token() {
  return {random_hex(id_digits), random_hex(secret_digits)};
}

bool is_token_id(std::string_view id) {
  return is_hex(id, id_digits);
}

std::optional<TokenText> read_token(std::string_view text) {
  if (text.size() != prefix.size() + id_digits + 1 + secret_digits || !text.starts_with(prefix)) return std::nullopt;
  const std::string_view id = text.substr(prefix.size(), id_digits);
  const std::string_view secret = text.substr(prefix.size() + id_digits + 1);
  if (!is_hex(id, id_digits) || text[prefix.size() + id_digits] != '_' || !is_hex(secret, secret_digits)) return std::nullopt;
  return TokenText{std::string(id), std::string(secret)};
}

std::string sha256(std::string_view bytes) {
  std::string hash(hash_bytes, '\0');
  auto* place = reinterpret_cast<unsigned char*>(hash.data());
  if (EVP_Digest(bytes.data(), bytes.size(), place, nullptr, EVP_sha256(), nullptr) != 1)
    throw std::runtime_error("SHA-256 failed");
  return hash;
}

bool is_same_hash(std::string_view a, std::string_view b) {
  return a.size() == hash_bytes && b.size() == hash_bytes && CRYPTO_memcmp(a.data(), b.data(), hash_bytes) == 0;
}

}  // namespace bedflow
