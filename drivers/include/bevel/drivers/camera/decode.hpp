// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Decoding of image files and JPEG frames to brightness. All programs and tests decode with these functions, since a
/// plain call of OpenCV's imread() rotates the image by its EXIF orientation and divides 16-bit samples by 256.
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <span>
#include <string>

namespace bevel::camera {

/// A decoded image with the rows and columns of the sensor.
struct DecodedImage {
  cv::Mat gray;         ///< CV_8UC1, row 0 is the first row in the file; empty if the bytes are not a readable image
  int orientation = 1;  ///< EXIF or TIFF orientation tag, 1 to 8; it is not applied
  int bits = 8;         ///< bits per sample that `gray` was scaled from: 8, 10, 12, 14 or 16
};

/// Decodes a JPEG, PNG, BMP, PNM or TIFF image and ignores its orientation tag. Samples of 16-bit images are scaled
/// from the number of bits that they use: a 12-bit sensor fills only 12 of the 16 bits in many PNG files.
/// @param bytes the whole file, or one MJPEG frame
/// @param least_bits bits in use at least, 8 to 16; pass the largest value so far for one brightness scale in a
/// sequence
/// @return the image; `gray` is empty if the image cannot be decoded. Does not throw cv::Exception.
/// Source: EXIF 2.32 (CIPA DC-008), section 4.6.4, tag 0x0112; TIFF 6.0, section 2.
DecodedImage decode_gray(std::span<const uint8_t> bytes, int least_bits = 8);

/// Reads and decodes a file, as decode_gray() does.
/// @param file       path of the file
/// @param least_bits bits in use at least, 8 to 16
/// @return the image; `gray` is empty if the image cannot be read or decoded
DecodedImage read_gray(const std::filesystem::path& file, int least_bits = 8);

/// States that an image carries an orientation tag and that it is ignored.
/// @param name        the file or device, for the message
/// @param orientation orientation tag, 1 to 8
/// @return remark; empty if `orientation` is 1
std::string orientation_remark(const std::string& name, int orientation);

}  // namespace bevel::camera
