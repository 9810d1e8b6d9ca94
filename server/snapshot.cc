#include "server/snapshot.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/crc32c.h"
#include "core/base/fault.h"
#include "server/encode_stored.h"
#include "server/stored.pb.h"

namespace lpdeform {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are little-endian");

constexpr std::string_view kMagic = "lpdeform";

struct Header {
  char magic[8];
  std::uint32_t format;
  std::uint32_t crc32c;
  std::uint64_t bytes;
};
static_assert(sizeof(Header) == kSnapshotHeaderBytes);

absl::Status refused(const char* reason, const std::string& limit, std::string_view text) {
  return invalid_input({reason, "snapshot", limit}, text);
}

absl::Status truncated(std::size_t has, const std::string& should) {
  return refused("SNAPSHOT_TRUNCATED", absl::StrCat(should, " bytes"),
                 absl::StrCat("The snapshot has ", has, " bytes of ", should, "; its end is missing."));
}

/// What follows the header.
absl::StatusOr<std::string_view> content_of(std::string_view file) {
  if (file.substr(0, kMagic.size()) != kMagic.substr(0, file.size()) || file.empty())
    return refused("SNAPSHOT_FOREIGN", "",
                   "The file is no snapshot of a session: it does not begin like one.");
  if (file.size() < sizeof(Header)) return truncated(file.size(), absl::StrCat("at least ", sizeof(Header)));
  Header header;
  std::memcpy(&header, file.data(), sizeof(Header));
  if (header.format > kSnapshotFormat) {
    return refused("SNAPSHOT_NEWER", absl::StrCat("format <= ", kSnapshotFormat),
                   absl::StrCat("The snapshot's format is ", header.format, "; this server reads up to ",
                                kSnapshotFormat, ". Use a later server."));
  }
  if (header.format == 0) return snapshot_damaged("its format is 0");
  const std::string_view content = file.substr(sizeof(Header));
  if (content.size() < header.bytes) {
    return truncated(file.size(), header.bytes > std::numeric_limits<std::uint64_t>::max() - sizeof(Header)
                                      ? absl::StrCat(header.bytes, " and ", sizeof(Header))
                                      : absl::StrCat(header.bytes + sizeof(Header)));
  }
  if (content.size() > header.bytes) return snapshot_damaged("something follows its end");
  if (crc32c(content) != header.crc32c) return snapshot_damaged("its checksum differs");
  return content;
}

}  // namespace

absl::Status snapshot_damaged(std::string_view why) {
  return refused("SNAPSHOT_DAMAGED", "",
                 absl::StrCat("The snapshot is damaged: ", absl::string_view(why.data(), why.size()), "."));
}

std::string snapshot_header(std::string_view content) {
  Header header{{}, kSnapshotFormat, crc32c(content), content.size()};
  std::memcpy(header.magic, kMagic.data(), kMagic.size());
  return {reinterpret_cast<const char*>(&header), sizeof(header)};
}

std::size_t snapshot_bytes(const Session& session) {
  // Positions, normals and surface; p and stiffness; the weld. A handle's part is that of its vertices.
  constexpr std::size_t kBytesAVertex = 3 * 24 + 2 * 8 + 4 + 32;
  return 2 * (kBytesAVertex * session.vertex_count() +
              12 * static_cast<std::size_t>(session.mesh().faces().rows()));
}

std::string encode_snapshot(const Session& session) {
  stored::Snapshot snapshot;
  encode_mesh(session.info(), *snapshot.mutable_head()->mutable_request());
  for (auto& [name, part] : encode_changes(session.changes_since(0))) {
    if (part && name != "writer") (*snapshot.mutable_parts())[name] = *std::move(part);
  }
  if (session.has_surface())
    encode_positions(session.newest_frame()->surface->positions(), *snapshot.mutable_surface());
  std::string file(sizeof(Header), '\0');
  {
    google::protobuf::io::StringOutputStream stream(&file);  // appends
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    snapshot.SerializeToCodedStream(&coded);
  }
  const std::string header = snapshot_header(std::string_view(file).substr(sizeof(Header)));
  file.replace(0, header.size(), header);
  return file;
}

absl::StatusOr<Snapshot> decode_snapshot(std::string_view file) {
  const auto content = content_of(file);
  if (!content.ok()) return content.status();
  stored::Snapshot message;
  if (content->size() > std::numeric_limits<int>::max() ||
      !message.ParseFromArray(content->data(), static_cast<int>(content->size())))
    return snapshot_damaged("it cannot be read");
  Snapshot snapshot;
  snapshot.request = std::move(*message.mutable_head()->mutable_request());
  for (auto& [name, part] : *message.mutable_parts()) snapshot.parts[name] = std::move(part);
  if (message.has_surface()) snapshot.surface = std::move(*message.mutable_surface());
  return snapshot;
}

}  // namespace lpdeform
