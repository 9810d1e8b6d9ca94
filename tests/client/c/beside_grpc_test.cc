// A program with its own gRPC, Protocol Buffers and Abseil, like an engine, loads the shared library with global symbols:
// neither interferes with the other. beside_grpc_test LIBRARY

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/c/lpdeform.h"
#include "tests/client/c/shapes.h"
#include "tests/client/in_process_server.h"

namespace {

std::string library_path;

template <typename Function>
Function* find(void* library, const char* name) {
  void* const found = dlsym(library, name);
  EXPECT_NE(found, nullptr) << name;
  return reinterpret_cast<Function*>(found);
}

TEST(SharedLibrary, WorksInAProgramWithAnotherGrpc) {
  const lpdeform::client::InProcessServer server;  // this program's gRPC, with the same messages
  void* const library = dlopen(library_path.c_str(), RTLD_NOW | RTLD_GLOBAL);
  ASSERT_NE(library, nullptr) << dlerror();
  const auto connect = find<decltype(lpdeform_connect)>(library, "lpdeform_connect");
  const auto open = find<decltype(lpdeform_open)>(library, "lpdeform_open");
  const auto settle = find<decltype(lpdeform_settle)>(library, "lpdeform_settle");
  const auto close = find<decltype(lpdeform_close)>(library, "lpdeform_close");
  const auto disconnect = find<decltype(lpdeform_disconnect)>(library, "lpdeform_disconnect");

  lpdeform_error error{};
  error.struct_size = sizeof error;
  lpdeform_connection connection{};
  connection.struct_size = sizeof connection;
  const std::string address = server.address();
  connection.address = address.c_str();
  lpdeform_client* client = nullptr;
  ASSERT_EQ(connect(&connection, &client, &error), LPDEFORM_OK) << error.message;

  const lpdeform::engine::Triangle triangle;
  const lpdeform_mesh mesh = triangle.mesh();
  lpdeform_session* session = nullptr;
  ASSERT_EQ(open(client, &mesh, nullptr, &session, &error), LPDEFORM_OK) << error.message;

  std::vector<lpdeform::engine::Point> out(3);
  const lpdeform_buffers buffers = lpdeform::engine::buffers_of(out);
  EXPECT_EQ(settle(session, 60, &buffers, nullptr, &error), LPDEFORM_OK) << error.message;
  EXPECT_EQ(out, triangle.points);  // nothing holds it: as at rest
  close(session);
  disconnect(client);
  EXPECT_EQ(dlclose(library), 0);
  EXPECT_NE(dlopen(library_path.c_str(), RTLD_NOW | RTLD_NOLOAD), nullptr)
      << "it was unloaded under its threads";
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc != 2) return 2;
  library_path = argv[1];
  return RUN_ALL_TESTS();
}
