#include "server/keeping/snapshot.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/crc32c.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/keeping/encode_stored.h"
#include "server/keeping/stored.pb.h"
#include "server/wire/parsed_size.h"

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

absl::Status refused(Reason reason, const std::string& limit, std::string_view text) {
  return make_fault({reason, "snapshot", limit}, text);
}

absl::Status truncated(std::size_t has, const std::string& should) {
  return refused(Reason::kSnapshotTruncated, absl::StrCat(should, " bytes"),
                 absl::StrCat("The snapshot has ", has, " bytes of ", should, "; its end is missing."));
}

/// The content after the header.
absl::StatusOr<std::string_view> content_of(std::string_view file) {
  if (file.substr(0, kMagic.size()) != kMagic.substr(0, file.size()) || file.empty())
    return refused(Reason::kSnapshotForeign, "",
                   "The file is no snapshot of a session: it does not begin like one.");
  if (file.size() < sizeof(Header)) return truncated(file.size(), absl::StrCat("at least ", sizeof(Header)));
  Header header;
  std::memcpy(&header, file.data(), sizeof(Header));
  if (header.format > kSnapshotFormat) {
    return refused(Reason::kSnapshotNewer, absl::StrCat("format <= ", kSnapshotFormat),
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
  if (content.size() > kMostSnapshotBytes) return snapshot_damaged("it is longer than any");
  return content;
}

/// The type of a snapshot's part, which is stored as bytes, by the part's name.
const google::protobuf::Descriptor* part_in(const google::protobuf::Descriptor& type,
                                            std::string_view entry) {
  static const auto* const parts = stored::Snapshot::descriptor()->FindFieldByName("parts")->message_type();
  if (&type != parts) return nullptr;
  constexpr std::uint32_t kName = 1 << 3 | 2;
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(entry.data()),
                                            static_cast<int>(entry.size()));
  std::string_view name;
  while (const std::uint32_t tag = in.ReadTag()) {
    int size = 0;
    if ((tag & 7) != 2 || !in.ReadVarintSizeAsInt(&size)) break;
    if (tag == kName) name = entry.substr(static_cast<std::size_t>(in.CurrentPosition()), size);
    if (!in.Skip(size)) break;
  }
  return part_type(name);
}

/// Memory for the parsed content: its parts are copied and parsed in turn, and their values are made.
std::size_t memory_for(std::string_view content) {
  return 2 * parsed_size(*stored::Snapshot::descriptor(), content, part_in);
}

}  // namespace

absl::Status snapshot_damaged(std::string_view why) {
  return refused(Reason::kSnapshotDamaged, "",
                 absl::StrCat("The snapshot is damaged: ", absl::string_view(why.data(), why.size()), "."));
}

std::string snapshot_header(std::string_view content) {
  Header header{{}, kSnapshotFormat, crc32c(content), content.size()};
  std::memcpy(header.magic, kMagic.data(), kMagic.size());
  return {reinterpret_cast<const char*>(&header), sizeof(header)};
}

std::size_t snapshot_bytes(const Session& session) {
  // Positions, normals and surface; p and stiffness; the weld. A handle's vertices are counted with its part.
  constexpr std::size_t kBytesAVertex = 3 * 24 + 2 * 8 + 4 + 32;
  return 2 * (kBytesAVertex * session.vertex_count() +
              12 * static_cast<std::size_t>(session.mesh().faces().rows()));
}

absl::StatusOr<std::string> encode_snapshot(const Session& session, std::size_t most_bytes) {
  stored::Snapshot snapshot;
  encode_mesh(session.info(), *snapshot.mutable_head()->mutable_request());
  for (auto& [name, part] : encode_changes(session.changes_since(0))) {
    if (part && name != "writer") (*snapshot.mutable_parts())[name] = *std::move(part);
  }
  if (session.has_surface())
    encode_positions(session.newest_frame()->surface->positions(), *snapshot.mutable_surface());
  if (const std::size_t bytes = snapshot.ByteSizeLong(); bytes > most_bytes) {
    return make_fault(
        {Reason::kSnapshotTooLarge, "snapshot", absl::StrCat("bytes <= ", most_bytes)},
        absl::StrCat("The session's file would have ", bytes, " bytes; it can have ", most_bytes, "."));
  }
  std::string file(sizeof(Header), '\0');
  {
    google::protobuf::io::StringOutputStream stream(&file);  // appends
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    static_cast<void>(snapshot.SerializeToCodedStream(&coded));  // fails from 2 GiB on, which limits exclude
  }
  const std::string header = snapshot_header(std::string_view(file).substr(sizeof(Header)));
  file.replace(0, header.size(), header);
  return file;
}

absl::StatusOr<Snapshot> decode_snapshot(std::string_view file, Budget& budget, const std::string& owner) {
  const auto content = content_of(file);
  if (!content.ok()) return content.status();
  auto memory = budget.reserve(memory_for(*content), owner);
  if (!memory.ok()) return memory.status();
  stored::Snapshot message;
  if (!message.ParseFromArray(content->data(), static_cast<int>(content->size())))
    return snapshot_damaged("it cannot be read");
  Snapshot snapshot;
  snapshot.memory = *std::move(memory);
  snapshot.request = std::move(*message.mutable_head()->mutable_request());
  for (auto& [name, part] : *message.mutable_parts()) snapshot.parts[name] = std::move(part);
  if (message.has_surface()) snapshot.surface = std::move(*message.mutable_surface());
  return snapshot;
}

}  // namespace lpdeform
