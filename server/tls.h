// The server's certificate, its key, and whose certificates clients must have. The files are looked at every second: a renewed
// certificate serves from then on, without a restart.
#pragma once

#include <grpcpp/grpcpp.h>

#include <filesystem>
#include <memory>

namespace bedflow::server {

struct TlsFiles {
  std::filesystem::path certificate, key;  // PEM; the certificate with those that lead to its root behind it
  std::filesystem::path client_ca;         // PEM; empty: clients need no certificate

  bool given() const { return !certificate.empty() || !key.empty() || !client_ca.empty(); }
};

// Throws std::invalid_argument naming the file: one that is missing, not what it should be, a key that others may read or that is
// not the certificate's, a certificate that has expired. Warns in the log of one that will within two weeks.
void require_sound(const TlsFiles& files);

std::shared_ptr<grpc::ServerCredentials> tls_credentials(const TlsFiles& files,
                                                         const std::shared_ptr<grpc::AuthMetadataProcessor>& gate);

}  // namespace bedflow::server
