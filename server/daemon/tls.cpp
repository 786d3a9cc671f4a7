#include "daemon/tls.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
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

Certificate read_certificate(const std::string& path, const std::string& bytes) {
  const Bio text = open_text(bytes);
  Certificate certificate(PEM_read_bio_X509(text.get(), nullptr, nullptr, nullptr));
  if (!certificate) throw std::runtime_error(path + " holds no certificate in PEM form");
  return certificate;
}

/// A key that wants one would be asked for at the terminal.
int no_passphrase(char*, int, int, void*) { return 0; }

void check_key(const std::string& path, const std::string& bytes, X509& certificate,
               const std::string& path_of_certificate) {
  const Bio text = open_text(bytes);
  const Key key(PEM_read_bio_PrivateKey(text.get(), nullptr, no_passphrase, nullptr));
  if (!key) throw std::runtime_error(path + " holds no key in PEM form");
  if (X509_check_private_key(&certificate, key.get()) != 1)
    throw std::runtime_error("the key in " + path + " is not that of the certificate in " +
                             path_of_certificate);
}

/// A file without a name, which ends with the process.
shm::Descriptor in_memory() {
  shm::Descriptor file(::memfd_create("certificate", MFD_CLOEXEC));
  if (!file) throw std::runtime_error(std::string("no file in memory: ") + std::strerror(errno));
  return file;
}

std::string path_of(const shm::Descriptor& file) {
  return "/proc/self/fd/" + std::to_string(file.get());
}

void put(const std::string& bytes, const shm::Descriptor& file) {
  const auto size = static_cast<ssize_t>(bytes.size());
  if (::pwrite(file.get(), bytes.data(), bytes.size(), 0) != size ||
      ::ftruncate(file.get(), size) != 0)
    throw std::runtime_error(std::string("a copy cannot be kept: ") + std::strerror(errno));
}

}  // namespace

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path + ": " + std::strerror(errno));
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

ServerCertificate::ServerCertificate(const Config& config) {
  for (const std::string& path : {config.tls_certificate, config.tls_key, config.tls_client_ca})
    if (!path.empty()) files_.push_back({path, FileWatch(path), in_memory()});
  take();
}

void ServerCertificate::take() {
  std::vector<std::string> bytes;
  for (const File& file : files_) bytes.push_back(read_file(file.path));
  const Certificate certificate = read_certificate(files_[0].path, bytes[0]);
  check_key(files_[1].path, bytes[1], *certificate, files_[0].path);
  if (authority()) (void)read_certificate(authority()->path, bytes[2]);
  for (std::size_t k = 0; k < files_.size(); ++k) put(bytes[k], files_[k].copy);
}

bool ServerCertificate::reload(bool asked) {
  bool changed = asked;
  for (File& file : files_) changed = file.watch.has_changed() || changed;
  if (changed) take();
  return changed;
}

std::shared_ptr<grpc::ServerCredentials> ServerCertificate::credentials() const {
  using namespace grpc::experimental;
  constexpr unsigned kLookSeconds = 1;
  TlsServerCredentialsOptions options(std::make_shared<FileWatcherCertificateProvider>(
      path_of(files_[1].copy), path_of(files_[0].copy),
      authority() ? path_of(authority()->copy) : "", kLookSeconds));
  options.watch_identity_key_cert_pairs();
  if (authority()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  } else {
    options.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  }
  return TlsServerCredentials(options);
}

}  // namespace mbcosim::server
