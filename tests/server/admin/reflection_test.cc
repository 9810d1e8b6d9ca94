// What a client without the contract can ask the server about itself, like grpcurl and grpc_cli.

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/empty.pb.h>
#include <google/protobuf/unknown_field_set.h>
#include <grpcpp/generic/generic_stub.h>

#include <algorithm>
#include <string>
#include <vector>

#include "service_fixture.h"

namespace lpdeform {
namespace {

// Numbers of fields in grpc/reflection/v1/reflection.proto; v1alpha has the same.
constexpr char kFileContainingSymbol = 4, kListServices = 7;
constexpr int kFileDescriptors = 4, kServices = 6;

/// What the field of this number has in it, as often as it is there.
std::vector<std::string> fields_of(const std::string& message, int number) {
  google::protobuf::UnknownFieldSet fields;
  EXPECT_TRUE(fields.ParseFromString(message));
  std::vector<std::string> found;
  for (int k = 0; k < fields.field_count(); ++k) {
    if (fields.field(k).number() == number) found.emplace_back(fields.field(k).length_delimited());
  }
  return found;
}

class ReflectionTest : public ServiceTest {
 protected:
  /// The answer to a request with this text in its field; empty where this form of reflection is not served.
  std::string ask(const std::string& form, char field, const std::string& text) {
    grpc::GenericStub stub(grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
    grpc::CompletionQueue queue;
    void* tag = nullptr;
    bool is_ok = false;
    const auto done = [&] { return queue.Next(&tag, &is_ok) && is_ok; };
    const auto call = stub.PrepareCall(
        &context, "/grpc.reflection." + form + ".ServerReflection/ServerReflectionInfo", &queue);
    call->StartCall(nullptr);
    EXPECT_TRUE(done());
    std::string request{static_cast<char>(field << 3 | 2), static_cast<char>(text.size())};
    const grpc::Slice slice(request += text);
    call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
    queue.Next(&tag, &is_ok);
    grpc::ByteBuffer answer;
    call->Read(&answer, nullptr);
    const bool is_answered = done();
    context.TryCancel();
    grpc::Status status;
    call->Finish(&status, nullptr);
    queue.Next(&tag, &is_ok);
    if (!is_answered) return "";
    std::vector<grpc::Slice> slices;
    EXPECT_TRUE(answer.Dump(&slices).ok());
    std::string bytes;
    for (const grpc::Slice& one : slices)
      bytes.append(reinterpret_cast<const char*>(one.begin()), one.size());
    return bytes;
  }

  std::vector<std::string> services(const std::string& form) {
    std::vector<std::string> names;
    for (const std::string& list : fields_of(ask(form, kListServices, "*"), kServices)) {
      for (const std::string& service : fields_of(list, 1)) names.push_back(fields_of(service, 1).at(0));
    }
    return names;
  }

  /// Whether a file that describes this service is given out.
  bool is_described(const std::string& form, const std::string& service) {
    for (const std::string& files : fields_of(ask(form, kFileContainingSymbol, service), kFileDescriptors)) {
      for (const std::string& bytes : fields_of(files, 1)) {
        google::protobuf::FileDescriptorProto file;
        EXPECT_TRUE(file.ParseFromString(bytes));
        for (const auto& one : file.service()) {
          if (file.package() + "." + one.name() == service) return one.method_size() > 0;
        }
      }
    }
    return false;
  }
};

TEST_F(ReflectionTest, DescribesEachServiceThatItLists) {
  int forms = 0;
  for (const std::string form : {"v1alpha", "v1"}) {  // which of them there are is gRPC's
    const std::vector<std::string> names = services(form);
    if (names.empty()) continue;
    ++forms;
    for (const char* const expected : {"lpdeform.v1.DeformService", "grpc.health.v1.Health"})
      EXPECT_EQ(std::count(names.begin(), names.end(), expected), 1) << form << " " << expected;
    for (const std::string& name : names) EXPECT_TRUE(is_described(form, name)) << form << " " << name;
  }
  EXPECT_GT(forms, 0);
}

}  // namespace
}  // namespace lpdeform
