#include "io/csv_export.hpp"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace bevel::io {
namespace {

template <class Row, class Write>
void write_file(std::vector<std::pair<std::string, std::int64_t>>& done, const std::string& path, const char* header,
                const std::vector<Row>& rows, Write&& write) {
  if (rows.empty()) return;
  std::ofstream file(path);
  file.precision(17);
  file << header << '\n';
  for (const Row& row : rows) write(file, row);
  file.flush();
  if (!file) throw std::runtime_error(path + ": cannot be written");
  done.emplace_back(path, static_cast<std::int64_t>(rows.size()));
}

void write_needle_state(std::ofstream& file, const needle_state_t& m) {
  file << m.utime << ',' << m.seq << ',' << m.measurement_utime;
  for (const double v : m.position_mm) file << ',' << v;
  for (const double v : m.orientation_wxyz) file << ',' << v;
  file << ',' << m.curvature_per_mm << ',' << m.lambda1_per_rad << ',' << m.lambda2 << ',' << m.test_ratio << ','
       << m.rank << ',' << m.health << ',' << m.reset_count;
  for (const double v : m.covariance) file << ',' << v;
  file << '\n';
}

std::string needle_header() {
  std::string header =
      "utime,seq,measurement_utime,x_mm,y_mm,z_mm,qw,qx,qy,qz,curvature_per_mm,lambda1_per_rad,lambda2,test_ratio,rank,"
      "health,reset_count";
  for (int r = 0; r < 9; ++r)
    for (int c = 0; c < 9; ++c) header.append(",p").append(std::to_string(r)).append("_").append(std::to_string(c));
  return header;
}

}  // namespace

std::vector<std::pair<std::string, std::int64_t>> export_csv(const Recording& recording, const std::string& folder) {
  std::filesystem::create_directories(folder);
  std::vector<std::pair<std::string, std::int64_t>> done;
  const auto write_reading = [](std::ofstream& file, const auto& m, const Eigen::Vector3d& value,
                                const Eigen::Matrix3d& information) {
    file << m.utime << ',' << m.seq << ',' << m.camera << ',' << m.status;
    for (const double v : value) file << ',' << v;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) file << ',' << information(r, c);
    file << '\n';
  };
  write_file(done, folder + "/tip_measurement.csv",
             "utime,seq,camera,status,x_mm,y_mm,z_mm,ixx_per_mm2,ixy_per_mm2,ixz_per_mm2,iyx_per_mm2,iyy_per_mm2,"
             "iyz_per_mm2,izx_per_mm2,izy_per_mm2,izz_per_mm2",
             recording.tips, [&](std::ofstream& file, const model::TipMeasurement& m) {
               write_reading(file, m, m.position_mm, m.information_per_mm2);
             });
  write_file(done, folder + "/tip_heading.csv",
             "utime,seq,camera,status,heading_x,heading_y,heading_z,ixx_per_rad2,ixy_per_rad2,ixz_per_rad2,"
             "iyx_per_rad2,iyy_per_rad2,iyz_per_rad2,izx_per_rad2,izy_per_rad2,izz_per_rad2",
             recording.headings, [&](std::ofstream& file, const model::TipHeading& m) {
               write_reading(file, m, m.heading, m.information_per_rad2);
             });
  write_file(done, folder + "/actuator_state.csv",
             "utime,seq,insertion_status,rotation_status,insertion_mm,insertion_rate_mm_s,rotation_rad,"
             "rotation_rate_rad_s",
             recording.actuators, [](std::ofstream& file, const model::ActuatorState& a) {
               file << a.utime << ',' << a.seq << ',' << a.axis_status[0] << ',' << a.axis_status[1] << ','
                    << a.insertion_mm << ',' << a.insertion_rate_mm_s << ',' << a.rotation_rad << ','
                    << a.rotation_rate_rad_s << '\n';
             });
  write_file(done, folder + "/motion_command.csv", "utime,seq,mode,insertion_rate_mm_s,rotation_rate_rad_s",
             recording.commands, [](std::ofstream& file, const model::MotionCommand& c) {
               file << c.utime << ',' << c.seq << ',' << c.mode << ',' << c.insertion_rate_mm_s << ','
                    << c.rotation_rate_rad_s << '\n';
             });
  const std::string header = needle_header();
  write_file(done, folder + "/needle_state.csv", header.c_str(), recording.estimates, write_needle_state);
  write_file(done, folder + "/needle_truth.csv", header.c_str(), recording.truths, write_needle_state);
  return done;
}

}  // namespace bevel::io
