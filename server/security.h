// What may listen, and which names may come in. Nothing listens beyond the machine without TLS, which brings tokens with it
// (door.h); a client never names a file.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace bedflow::server {

// What gRPC is to listen on ("unix:/run/x.sock", "127.0.0.1:4000"). Throws std::invalid_argument with the reason: a TCP address
// other than loopback without TLS, a socket in a folder that others may enter, a path too long for a socket.
std::string listen_address(const std::string& wanted, bool has_tls = false);

// Creates the folder, or takes away what others may do in it (mode 0700). Throws std::system_error.
void make_private(const std::filesystem::path& folder);

bool is_job_id(std::string_view id);           // j-<12 hex digits>
bool is_request_id(std::string_view id);       // [A-Za-z0-9-]{8,64}
bool is_label_key(std::string_view key);       // [a-z0-9][a-z0-9._/-]{0,62}
bool is_owner(std::string_view name);          // the same without /
std::string printable(std::string_view text);  // at most 80 characters, others than printable ASCII escaped: for messages

std::string new_job_id();  // from the system's random numbers

}  // namespace bedflow::server
