#include "tls.h"

#include <grpcpp/security/server_credentials.h>
#include <openssl/asn1.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

constexpr unsigned look_every = 1;  // s

struct Free {
  void operator()(BIO* one) const { BIO_free(one); }
  void operator()(X509* one) const { X509_free(one); }
  void operator()(EVP_PKEY* one) const { EVP_PKEY_free(one); }
};
using Bio = std::unique_ptr<BIO, Free>;
using Certificate = std::unique_ptr<X509, Free>;
using Key = std::unique_ptr<EVP_PKEY, Free>;

[[noreturn]] void refuse(const std::string& option, const fs::path& file, const std::string& why) {
  throw std::invalid_argument(option + " " + file.string() + ": " + why);
}

std::string text_of(const std::string& option, const fs::path& file) {
  if (!fs::exists(file)) refuse(option, file, "is not there");
  std::ifstream stream(file, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(stream), {});
  if (text.empty()) refuse(option, file, "is empty, or cannot be read");
  return text;
}

Certificate certificate_of(const std::string& option, const fs::path& file) {
  const std::string text = text_of(option, file);
  const Bio bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  Certificate certificate(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
  if (!certificate) refuse(option, file, "has no certificate in PEM (-----BEGIN CERTIFICATE-----)");
  return certificate;
}

int no_passphrase(char*, int, int, void*) {
  return -1;
}

Key key_of(const fs::path& file) {
  const std::string text = text_of("--tls-key", file);
  const Bio bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  Key key(PEM_read_bio_PrivateKey(bio.get(), nullptr, no_passphrase, nullptr));
  if (!key) refuse("--tls-key", file, "has no private key in PEM without a passphrase");
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0 && (status.st_mode & 0007) != 0)
    refuse("--tls-key", file, "can be read by everybody on the machine; chmod 600 it");
  return key;
}

std::string date_of(const ASN1_TIME* time) {
  const Bio bio(BIO_new(BIO_s_mem()));
  ASN1_TIME_print(bio.get(), time);
  char* text = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

}  // namespace

void require_sound(const TlsFiles& files) {
  if (files.certificate.empty()) throw std::invalid_argument("--tls-certificate FILE is missing: TLS needs a certificate");
  if (files.key.empty()) throw std::invalid_argument("--tls-key FILE is missing: the private key of the certificate");
  const auto certificate = certificate_of("--tls-certificate", files.certificate);
  const auto key = key_of(files.key);
  if (X509_check_private_key(certificate.get(), key.get()) != 1)
    refuse("--tls-key", files.key, "is not the key of the certificate " + files.certificate.string());
  const ASN1_TIME* end = X509_get0_notAfter(certificate.get());
  if (X509_cmp_current_time(end) < 0) refuse("--tls-certificate", files.certificate, "has expired at " + date_of(end));
  constexpr std::time_t fortnight = 14 * 24 * 3600;
  std::time_t soon = std::time(nullptr) + fortnight;
  if (X509_cmp_time(end, &soon) < 0)
    spdlog::warn("the certificate {} expires at {}; one that is put in its place serves at once", files.certificate.string(),
                 date_of(end));
  if (!files.client_ca.empty()) certificate_of("--client-ca", files.client_ca);
}

std::shared_ptr<grpc::ServerCredentials> tls_credentials(const TlsFiles& files,
                                                         const std::shared_ptr<grpc::AuthMetadataProcessor>& gate) {
  namespace tls = grpc::experimental;
  tls::TlsServerCredentialsOptions options(
      std::make_shared<tls::FileWatcherCertificateProvider>(files.key, files.certificate, files.client_ca, look_every));
  options.watch_identity_key_cert_pairs();
  if (files.client_ca.empty()) {
    options.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  } else {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  auto credentials = tls::TlsServerCredentials(options);
  credentials->SetAuthMetadataProcessor(gate);
  return credentials;
}

}  // namespace bedflow::server
