#include "daemon/tls.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace mbcosim::server {
namespace {

template <class T, auto free_it>
using Owned = std::unique_ptr<T, decltype([](T* object) { free_it(object); })>;
using Bio = Owned<BIO, BIO_free_all>;
using Certificate = Owned<X509, X509_free>;
using Key = Owned<EVP_PKEY, EVP_PKEY_free>;

Bio open_text(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

Certificate read_certificate(const std::string& path) {
  const std::string bytes = read_file(path);
  const Bio text = open_text(bytes);
  Certificate certificate(PEM_read_bio_X509(text.get(), nullptr, nullptr, nullptr));
  if (!certificate) throw std::runtime_error(path + " holds no certificate in PEM form");
  return certificate;
}

/// A key that wants one would be asked for at the terminal.
int no_passphrase(char*, int, int, void*) { return 0; }

/// A pair that does not fit would refuse every connection, and say so nowhere.
void check_pair(const Config& config) {
  const Certificate certificate = read_certificate(config.tls_certificate);
  const std::string bytes = read_file(config.tls_key);
  const Bio text = open_text(bytes);
  const Key key(PEM_read_bio_PrivateKey(text.get(), nullptr, no_passphrase, nullptr));
  if (!key) throw std::runtime_error(config.tls_key + " holds no key in PEM form");
  if (X509_check_private_key(certificate.get(), key.get()) != 1)
    throw std::runtime_error("the key in " + config.tls_key +
                             " is not that of the certificate in " + config.tls_certificate);
}

}  // namespace

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::shared_ptr<grpc::ServerCredentials> watched_credentials(const Config& config) {
  using namespace grpc::experimental;
  constexpr unsigned kLookSeconds = 1;
  check_pair(config);
  if (!config.tls_client_ca.empty()) (void)read_certificate(config.tls_client_ca);
  TlsServerCredentialsOptions options(std::make_shared<FileWatcherCertificateProvider>(
      config.tls_key, config.tls_certificate, config.tls_client_ca, kLookSeconds));
  options.watch_identity_key_cert_pairs();
  if (config.tls_client_ca.empty()) {
    options.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  } else {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return TlsServerCredentials(options);
}

}  // namespace mbcosim::server
