#include "rpc/reflection.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <set>

#include "grpc/reflection/v1alpha/reflection.pb.h"
#include "rpc/methods.h"

namespace mbcosim::server {
namespace {

namespace reflection = grpc::reflection::v1alpha;
using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;

void fail(const std::string& what, reflection::ServerReflectionResponse* response) {
  response->mutable_error_response()->set_error_code(grpc::StatusCode::NOT_FOUND);
  response->mutable_error_response()->set_error_message(what);
}

/// The file after all that it imports, each once.
void put(const FileDescriptor& file, std::set<const FileDescriptor*>& known,
         reflection::FileDescriptorResponse* out) {
  if (!known.insert(&file).second) return;
  google::protobuf::FileDescriptorProto proto;
  file.CopyTo(&proto);
  out->add_file_descriptor_proto(proto.SerializeAsString());
  for (int i = 0; i < file.dependency_count(); ++i) put(*file.dependency(i), known, out);
}

void put_file(const FileDescriptor* file, const std::string& wanted,
              reflection::ServerReflectionResponse* response) {
  if (!file) return fail("not found: " + wanted.substr(0, 100), response);
  std::set<const FileDescriptor*> known;
  put(*file, known, response->mutable_file_descriptor_response());
}

void put_services(const Gate& gate, reflection::ListServiceResponse* out) {
  std::set<std::string> names;
  for (const auto& [path, method] : gate.methods())
    names.insert(path.substr(1, path.rfind('/') - 1));
  for (const std::string& name : names) out->add_service()->set_name(name);
}

void answer(const Gate& gate, const reflection::ServerReflectionRequest& request,
            reflection::ServerReflectionResponse* response) {
  using Request = reflection::ServerReflectionRequest;
  const DescriptorPool& pool = *DescriptorPool::generated_pool();
  response->set_valid_host(request.host());
  *response->mutable_original_request() = request;
  switch (request.message_request_case()) {
    case Request::kListServices:
      return put_services(gate, response->mutable_list_services_response());
    case Request::kFileByFilename:
      return put_file(pool.FindFileByName(request.file_by_filename()), request.file_by_filename(),
                      response);
    case Request::kFileContainingSymbol:
      return put_file(pool.FindFileContainingSymbol(request.file_containing_symbol()),
                      request.file_containing_symbol(), response);
    case Request::kAllExtensionNumbersOfType:
      if (!pool.FindMessageTypeByName(request.all_extension_numbers_of_type()))
        return fail("not found: " + request.all_extension_numbers_of_type().substr(0, 100),
                    response);
      response->mutable_all_extension_numbers_response()->set_base_type_name(
          request.all_extension_numbers_of_type());
      return;
    case Request::kFileContainingExtension:
      return fail("there are no extensions", response);
    case Request::MESSAGE_REQUEST_NOT_SET:
      response->mutable_error_response()->set_error_code(grpc::StatusCode::INVALID_ARGUMENT);
      response->mutable_error_response()->set_error_message("nothing is asked");
  }
}

/// Short questions about constant things: answered by the pollers, one at a time.
class ReflectionHandler final : public Handler {
 public:
  explicit ReflectionHandler(const Gate& gate) : gate_(gate) {}

 private:
  void on_message(Exchange& exchange, grpc::ByteBuffer message) override {
    reflection::ServerReflectionRequest request;
    reflection::ServerReflectionResponse response;
    parse(exchange.memory(), message, &request, nullptr);
    answer(gate_, request, &response);
    exchange.write(serialized(response));
  }
  void on_written(Exchange& exchange) override { exchange.read(Exchange::kIdleStream); }
  void on_half_close(Exchange& exchange) override { exchange.finish(grpc::Status::OK); }

  const Gate& gate_;
};

}  // namespace

void add_reflection(Gate& gate) {
  for (const char* version : {"v1", "v1alpha"}) {
    gate.add(std::string("/grpc.reflection.") + version + ".ServerReflection/ServerReflectionInfo",
             {Role::observe, false, Counted::stream,
              [&gate] { return std::make_unique<ReflectionHandler>(gate); }});
  }
}

}  // namespace mbcosim::server
