// A race between a gRPC callback and the thread that made the call. See seeded_race.h.

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <cstdio>
#include <string>

#include "tests/support/seeded_race.h"

namespace {

std::atomic<int> arrived = 0;

class Reaction : public grpc::ServerGenericBidiReactor {
 public:
  Reaction() {
    meet(arrived);
    count_up();
    Finish(grpc::Status::OK);
  }
  void OnDone() override { delete this; }
};

class Service : public grpc::CallbackGenericService {
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    return new Reaction;
  }
};

}  // namespace

int main() {
  Service service;
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterCallbackGenericService(&service);
  const auto server = builder.BuildAndStart();

  grpc::CompletionQueue queue;
  grpc::GenericStub stub(
      grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto call = stub.PrepareCall(&context, "/seeded/Race", &queue);
  call->StartCall(&context);
  grpc::Status status;
  call->Finish(&status, &context);
  meet(arrived);
  count_up();

  void* tag = nullptr;
  bool is_ok = false;
  while (queue.Next(&tag, &is_ok) && tag != &context) {
  }
  server->Shutdown();
  std::printf("%d\n", shared_count);
}
