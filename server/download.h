// A checkpoint file sent to a client, and one taken from a client: bytes with their place and checksum. What the bytes mean is
// for bedflow-reader.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "bedflow/v1/service.pb.h"
#include "folder.h"

namespace bedflow::server {

// An open checkpoint file: it can be read to its end even when the engine takes its name away.
class Download {
 public:
  // Throws Refusal: checkpoint_not_found; bad_request for an offset beyond its end; checkpoint_changed when seal names another.
  Download(const JobFolder& folder, const v1::DownloadCheckpointRequest& request);
  ~Download();
  Download(const Download&) = delete;
  Download& operator=(const Download&) = delete;

  // The next part; false when there is none. The first says what file it is, even if there are no bytes to send.
  bool next(v1::DownloadCheckpointResponse& part);

 private:
  int file_ = -1;
  std::uint64_t bytes_ = 0, offset_ = 0, step_ = 0;
  std::string seal_;
  bool begun_ = false;
};

// The parts of a file that a client sends, in order. Throws Refusal: bad_upload, too_much, disk_full.
class Upload {
 public:
  Upload(const std::filesystem::path& file, const v1::ImportCheckpointRequest::Head& head);
  ~Upload();
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  void take(const v1::ImportCheckpointRequest& part);
  std::uint32_t finish();  // the checksum of the whole; bad_upload when bytes are missing

 private:
  int file_ = -1;
  std::uint64_t bytes_ = 0, have_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace bedflow::server
