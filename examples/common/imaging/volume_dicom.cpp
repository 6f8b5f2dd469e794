/* volume_dicom.cpp - folders of DICOM files, through GDCM, which is C++, for C. */
#if defined(__has_include)
#if __has_include(<gdcmImageReader.h>)
#define HAS_GDCM 1
#endif
#endif

#ifdef HAS_GDCM
#include <gdcmDirectory.h>
#include <gdcmImageReader.h>
#include <gdcmScanner.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <vector>

extern "C" {
#include "imaging/volume_format.h"
}

namespace {

const char *wanted_series, *series_option;

} // namespace

void volume_choose_series(const char *series, const char *option)
{
    wanted_series = series;
    series_option = option;
}

const char *volume_series_is_chosen(void) { return !wanted_series ? nullptr : series_option ? series_option : "a series"; }

#ifndef HAS_GDCM

bool volume_has_dicom(void) { return false; }

bool volume_read_dicom(const char *, int, struct volume *, char error[VOLUME_TEXT])
{
    return volume_error(error, "a folder, not an image. DICOM is read where GDCM was found when this was built (Debian: libgdcm-dev); "
                        "dcm2niix makes a NIfTI file of it");
}

#else

bool volume_has_dicom(void) { return true; }

namespace {

const gdcm::Tag series_uid(0x0020, 0x000e), series_number(0x0020, 0x0011), series_description(0x0008, 0x103e), rows(0x0028, 0x0010),
    kind(0x0002, 0x0002);

/* Where a file has the places of its frames: for each frame, or as distances of planes of a dose. */
const gdcm::Tag shared_groups(0x5200, 0x9229), frame_groups(0x5200, 0x9230), plane_distances(0x3004, 0x000c);

/* Parts of the usual distance by which those of slices may differ without a word, and at all. */
const double regular = 0.01, bearable = 0.2;

struct series {
    std::string uid, number, description;
    std::vector<std::string> files;
};

struct slice {
    std::shared_ptr<gdcm::Image> image; /* of one frame or many */
    int frame;
    double slope, intercept;
    double origin[3], along[3], down[3]; /* mm, LPS: the first voxel, and the steps from column to column and from row to row */
    double place;                        /* mm along the normal */
    std::string file;
};

/* Values are padded with blanks, or with a zero. */
std::string trimmed(const char *value)
{
    std::string text(value ? value : "");
    const size_t last = text.find_last_not_of(std::string(" \0", 2));
    text.erase(last == std::string::npos ? 0 : last + 1);
    const size_t first = text.find_first_not_of(' ');
    return first == std::string::npos ? "" : text.substr(first);
}

const char *name_of(const std::string &path)
{
    const size_t slash = path.rfind('/');
    return path.c_str() + (slash == std::string::npos ? 0 : slash + 1);
}

/* Returns whether a file is of a kind that has rows: CT, MR or PET. Without them it is cut off between two elements. */
bool should_have_rows(const gdcm::Scanner &scanner, const std::string &file)
{
    static const char *const kinds[] = {"1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.4", "1.2.840.10008.5.1.4.1.1.128"};
    return std::find(std::begin(kinds), std::end(kinds), trimmed(scanner.GetValue(file.c_str(), kind))) != std::end(kinds);
}

bool damaged(const std::string &file, char error[VOLUME_TEXT])
{
    return volume_error(error, "%.100s: damaged, empty or cut off", name_of(file));
}

/* Lists the series of a folder, by their numbers. Returns false where a file is damaged. */
bool find_series(const char *path, std::vector<series> &list, char error[VOLUME_TEXT])
{
    gdcm::Directory folder;
    gdcm::Scanner scanner;
    folder.Load(path, false);
    std::vector<std::string> files = folder.GetFilenames();
    std::sort(files.begin(), files.end());
    for (const gdcm::Tag &tag : {series_uid, series_number, series_description, rows, kind}) {
        scanner.AddTag(tag);
    }
    for (const std::string &file : files) { /* before GDCM sees them */
        if (volume_look_at_dicom(file.c_str()) == DICOM_CUT) {
            return damaged(file, error);
        }
    }
    scanner.Scan(files);
    std::map<std::string, series> found;
    for (const std::string &file : files) {
        if (!scanner.IsKey(file.c_str())) {
            if (volume_look_at_dicom(file.c_str()) != NO_DICOM) {
                return damaged(file, error);
            }
            continue;
        }
        if (trimmed(scanner.GetValue(file.c_str(), rows)).empty()) {
            if (should_have_rows(scanner, file)) {
                return damaged(file, error);
            }
            continue; /* no image, such as DICOMDIR */
        }
        const std::string uid = trimmed(scanner.GetValue(file.c_str(), series_uid));
        series &one = found[uid];
        one.uid = uid;
        one.number = trimmed(scanner.GetValue(file.c_str(), series_number));
        one.description = trimmed(scanner.GetValue(file.c_str(), series_description));
        one.files.push_back(file);
    }
    for (const auto &entry : found) {
        list.push_back(entry.second);
    }
    std::stable_sort(list.begin(), list.end(),
                     [](const series &a, const series &b) { return atoi(a.number.c_str()) < atoi(b.number.c_str()); });
    return true;
}

std::string names_of(const std::vector<series> &list)
{
    std::string names;
    for (const series &one : list) {
        names += (names.empty() ? "" : ", ") + (one.number.empty() ? one.uid : one.number)
               + (one.description.empty() ? "" : " (" + one.description + ")");
    }
    return names;
}

/* Returns the series that is asked for, or the only one; NULL with the reason in `error`. */
const series *choose_series(const std::vector<series> &list, char error[VOLUME_TEXT])
{
    const series *chosen = nullptr;
    if (list.empty()) {
        volume_error(error, "a folder, not an image: there are no DICOM images in it");
        return nullptr;
    }
    if (!wanted_series && list.size() > 1) {
        volume_error(error, "%zu series in one folder: %.130s: %s%.30s", list.size(), names_of(list).c_str(),
                     series_option ? "choose one with " : "one is needed", series_option ? series_option : "");
        return nullptr;
    }
    for (const series &one : list) {
        if (!wanted_series || wanted_series == one.number || wanted_series == one.description || wanted_series == one.uid) {
            if (chosen) {
                volume_error(error, "there are several series %.60s: choose by the UID %.80s", wanted_series, one.uid.c_str());
                return nullptr;
            }
            chosen = &one;
        }
    }
    if (!chosen) {
        volume_error(error, "there is no series %.60s; there are %.120s", wanted_series, names_of(list).c_str());
    }
    return chosen;
}

/* Returns true where a file is shorter than its elements say, which GDCM lets pass. Elements of unknown length do not count. */
bool is_cut(const std::string &name, const gdcm::File &file)
{
    if (file.GetHeader().GetDataSetTransferSyntax() == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian) {
        return false;
    }
    int64_t least = int64_t(file.GetHeader().GetFullLength());
    for (const gdcm::DataElement &element : file.GetDataSet().GetDES()) {
        least += 8 + (element.GetVL().IsUndefined() || !element.GetByteValue() ? 0 : int64_t(uint32_t(element.GetVL())));
    }
    return volume_file_size(name.c_str()) < least;
}

int depth_of(const gdcm::Image &image) { return image.GetNumberOfDimensions() > 2 ? int(image.GetDimension(2)) : 1; }

/* Reads the numbers of an element of the first item of a sequence, "1\\2.5", 6 at most. Returns false, and leaves them, unless all are
   there. */
bool read_numbers(const gdcm::DataSet &group, const gdcm::Tag &sequence, const gdcm::Tag &tag, int count, double *numbers)
{
    const gdcm::SmartPointer<gdcm::SequenceOfItems> items =
        group.FindDataElement(sequence) ? group.GetDataElement(sequence).GetValueAsSQ() : nullptr;
    if (!items || items->GetNumberOfItems() == 0) {
        return false;
    }
    const gdcm::DataSet &item = items->GetItem(1).GetNestedDataSet();
    const gdcm::ByteValue *value = item.FindDataElement(tag) ? item.GetDataElement(tag).GetByteValue() : nullptr;
    const std::string text = value ? std::string(value->GetPointer(), value->GetLength()) : "";
    const char *at = text.c_str();
    double found[6];
    for (int n = 0; n < count; ++n) {
        char *end;
        found[n] = strtod(at, &end);
        if (end == at) {
            return false;
        }
        at = end + (*end == '\\');
    }
    std::copy(found, found + count, numbers);
    return true;
}

/* What a frame has of its own, or shares with all. */
struct frame {
    double origin[3], cosines[6], sides[2], slope, intercept; /* sides: from row to row, from column to column */
    bool placed;
};

void read_frame(const gdcm::DataSet &group, frame *one)
{
    const gdcm::Tag transformation(0x0028, 0x9145);
    one->placed = read_numbers(group, gdcm::Tag(0x0020, 0x9113), gdcm::Tag(0x0020, 0x0032), 3, one->origin) || one->placed;
    read_numbers(group, gdcm::Tag(0x0020, 0x9116), gdcm::Tag(0x0020, 0x0037), 6, one->cosines);
    read_numbers(group, gdcm::Tag(0x0028, 0x9110), gdcm::Tag(0x0028, 0x0030), 2, one->sides);
    read_numbers(group, transformation, gdcm::Tag(0x0028, 0x1053), 1, &one->slope);
    read_numbers(group, transformation, gdcm::Tag(0x0028, 0x1052), 1, &one->intercept);
}

/* Adds the frames of a file as slices, `like` in what GDCM has found. Returns false where a frame has no place. GDCM has no sides of voxels
 * where frames are out of order. */
bool add_frames(const gdcm::DataSet &elements, const slice &like, std::vector<slice> &slices)
{
    const gdcm::SmartPointer<gdcm::SequenceOfItems> groups = elements.GetDataElement(frame_groups).GetValueAsSQ();
    const gdcm::SmartPointer<gdcm::SequenceOfItems> all = elements.FindDataElement(shared_groups)
        ? elements.GetDataElement(shared_groups).GetValueAsSQ() : nullptr;
    const int count = depth_of(*like.image);
    frame shared = {};
    std::copy(like.image->GetDirectionCosines(), like.image->GetDirectionCosines() + 6, shared.cosines);
    shared.slope = like.slope;
    shared.intercept = like.intercept;
    if (all && all->GetNumberOfItems() > 0) {
        read_frame(all->GetItem(1).GetNestedDataSet(), &shared);
    }
    bool placed = groups && int(groups->GetNumberOfItems()) == count;
    for (int n = 0; placed && n < count; ++n) {
        slice one = like;
        frame own = shared;
        read_frame(groups->GetItem(size_t(n) + 1).GetNestedDataSet(), &own);
        placed = own.placed && own.sides[0] > 0.0 && own.sides[1] > 0.0;
        one.frame = n;
        one.slope = own.slope;
        one.intercept = own.intercept;
        for (int r = 0; r < 3; ++r) {
            one.origin[r] = own.origin[r];
            one.along[r] = own.cosines[r] * own.sides[1];
            one.down[r] = own.cosines[3 + r] * own.sides[0];
        }
        one.file += ", frame " + std::to_string(n + 1);
        slices.push_back(one);
    }
    return placed;
}

/* Adds the slices of a file; the planes of a dose count as one. */
bool read_file(const std::string &file, std::vector<slice> &slices, char error[VOLUME_TEXT])
{
    const char *name = name_of(file);
    gdcm::ImageReader reader;
    reader.SetFileName(file.c_str());
    if (!reader.Read() || is_cut(file, reader.GetFile())) {
        return volume_error(error, "%.100s: damaged, cut off, or compressed in a way that GDCM does not know", name);
    }
    slice one = {};
    one.image = std::make_shared<gdcm::Image>(reader.GetImage());
    one.file = name;
    one.slope = one.image->GetSlope();
    one.intercept = one.image->GetIntercept();
    if (one.image->GetPixelFormat().GetSamplesPerPixel() != 1) {
        return volume_error(error, "%.100s: a colour picture", name);
    }
    const double *cosines = one.image->GetDirectionCosines();
    for (int r = 0; r < 3; ++r) {
        one.origin[r] = one.image->GetOrigin(unsigned(r));
        one.along[r] = cosines[r] * one.image->GetSpacing(0);
        one.down[r] = cosines[3 + r] * one.image->GetSpacing(1);
    }
    const gdcm::DataSet &elements = reader.GetFile().GetDataSet();
    const bool grouped = depth_of(*one.image) > 1 && elements.FindDataElement(frame_groups);
    if (grouped ? !add_frames(elements, one, slices) : depth_of(*one.image) > 1 && !elements.FindDataElement(plane_distances)) {
        return volume_error(error, "%.100s: frames without places: a film?", name);
    }
    if (!grouped) {
        slices.push_back(one);
    }
    return true;
}

void normal_of(const slice &one, double normal[3])
{
    double length = 0.0;
    for (int r = 0; r < 3; ++r) {
        const int s = (r + 1) % 3, t = (r + 2) % 3;
        normal[r] = one.along[s] * one.down[t] - one.along[t] * one.down[s];
        length += normal[r] * normal[r];
    }
    for (int r = 0; r < 3; ++r) {
        normal[r] /= std::sqrt(length);
    }
}

/* Puts the slices in order along their normal. Returns false where they are of different grids. */
bool sort_slices(std::vector<slice> &slices, char error[VOLUME_TEXT])
{
    double normal[3];
    normal_of(slices[0], normal);
    for (slice &one : slices) {
        one.place = 0.0;
        double turned = 0.0;
        for (int r = 0; r < 3; ++r) {
            one.place += one.origin[r] * normal[r];
            turned = std::fmax(turned, std::fmax(std::fabs(one.along[r] - slices[0].along[r]), std::fabs(one.down[r] - slices[0].down[r])));
        }
        if (turned > 1e-3 || one.image->GetDimension(0) != slices[0].image->GetDimension(0)
            || one.image->GetDimension(1) != slices[0].image->GetDimension(1)) {
            return volume_error(error, "%.100s has other voxels or axes than %.100s", one.file.c_str(), slices[0].file.c_str());
        }
    }
    std::stable_sort(slices.begin(), slices.end(), [](const slice &a, const slice &b) { return a.place < b.place; });
    return true;
}

/* Returns how far a slice lies from its place between the first and the last, mm: along the normal or beside it. */
double off_line(const std::vector<slice> &slices, size_t k)
{
    const slice &first = slices.front(), &last = slices.back();
    const double part = double(k) / double(slices.size() - 1);
    double square = 0.0;
    for (int r = 0; r < 3; ++r) {
        const double off = slices[k].origin[r] - first.origin[r] - part * (last.origin[r] - first.origin[r]);
        square += off * off;
    }
    return std::sqrt(square);
}

/* Looks for slices that are missing, lie at one place, or beside the others. */
bool look_at_distances(const std::vector<slice> &slices, struct volume *volume, char error[VOLUME_TEXT])
{
    std::vector<double> steps;
    for (size_t k = 1; k < slices.size(); ++k) {
        steps.push_back(slices[k].place - slices[k - 1].place);
    }
    std::vector<double> sorted = steps;
    std::nth_element(sorted.begin(), sorted.begin() + long(sorted.size() / 2), sorted.end());
    const double usual = sorted[sorted.size() / 2];
    bool irregular = false;
    for (size_t k = 0; k < steps.size(); ++k) {
        const char *before = slices[k].file.c_str(), *after = slices[k + 1].file.c_str();
        if (steps[k] < 1e-3) {
            return volume_error(error, "%.100s and %.100s lie at one place: times or echoes in one series?", before, after);
        }
        if (std::fabs(steps[k] - usual) > bearable * usual) {
            return volume_error(error, "slices are missing: %.80s and %.80s lie %.4g mm apart, others %.4g mm", before, after, steps[k],
                                usual);
        }
        irregular = irregular || std::fabs(steps[k] - usual) > regular * usual;
    }
    for (size_t k = 1; k + 1 < slices.size(); ++k) {
        if (off_line(slices, k) > bearable * usual) {
            return volume_error(error, "%.100s lies %.4g mm off the line from the first slice to the last: shifted sideways?",
                                slices[k].file.c_str(), off_line(slices, k));
        }
        irregular = irregular || off_line(slices, k) > regular * usual;
    }
    if (irregular) {
        volume_add_warning(volume, "distances of the slices differ: their mean is taken");
    }
    return true;
}

double value_of(const char *bytes, gdcm::PixelFormat::ScalarType type, size_t n)
{
    switch (type) {
    case gdcm::PixelFormat::UINT8: return double(reinterpret_cast<const uint8_t *>(bytes)[n]);
    case gdcm::PixelFormat::INT8: return double(reinterpret_cast<const int8_t *>(bytes)[n]);
    case gdcm::PixelFormat::UINT16: return double(reinterpret_cast<const uint16_t *>(bytes)[n]);
    case gdcm::PixelFormat::INT16: return double(reinterpret_cast<const int16_t *>(bytes)[n]);
    case gdcm::PixelFormat::UINT32: return double(reinterpret_cast<const uint32_t *>(bytes)[n]);
    case gdcm::PixelFormat::INT32: return double(reinterpret_cast<const int32_t *>(bytes)[n]);
    case gdcm::PixelFormat::FLOAT32: return double(reinterpret_cast<const float *>(bytes)[n]);
    case gdcm::PixelFormat::FLOAT64: return reinterpret_cast<const double *>(bytes)[n];
    default: return double(NAN);
    }
}

/* The voxels of the file that was read last. */
struct unpacked {
    const gdcm::Image *of;
    std::vector<double> bytes; /* of doubles, for the alignment of any number */
};

/* Stores the voxels of a slice, or of a file of planes, from voxel `first` on, with their own slope and intercept. */
bool store_voxels(const slice &one, size_t first, size_t count, unpacked &file, struct volume *volume, char error[VOLUME_TEXT])
{
    const gdcm::PixelFormat format = one.image->GetPixelFormat();
    const size_t skipped = size_t(one.frame) * count;
    if (file.of != one.image.get()) {
        file.bytes.assign(one.image->GetBufferLength() / sizeof(double) + 1, 0.0);
        char *bytes = reinterpret_cast<char *>(file.bytes.data());
        file.of = one.image->GetBuffer(bytes) ? one.image.get() : nullptr;
    }
    const double zero = 0.0; /* of every type that is known */
    const char *buffer = reinterpret_cast<const char *>(file.bytes.data());
    if (!file.of || one.image->GetBufferLength() < (skipped + count) * format.GetPixelSize()
        || std::isnan(value_of(reinterpret_cast<const char *>(&zero), format.GetScalarType(), 0))) {
        return volume_error(error, "%.100s: its voxels cannot be read", one.file.c_str());
    }
    for (size_t n = 0; n < count; ++n) {
        volume_store(volume, first + n, one.slope * value_of(buffer, format.GetScalarType(), skipped + n) + one.intercept);
    }
    return true;
}

/* Sets the affine: the third column is the mean step from slice to slice, which need not be along their normal. */
bool place(const std::vector<slice> &slices, int depth, struct volume *volume, char error[VOLUME_TEXT])
{
    double normal[3];
    const slice &first = slices.front(), &last = slices.back();
    normal_of(first, normal);
    for (int r = 0; r < 3; ++r) {
        volume->affine[r][0] = first.along[r];
        volume->affine[r][1] = first.down[r];
        volume->affine[r][2] = slices.size() > 1 ? (last.origin[r] - first.origin[r]) / double(slices.size() - 1)
                                                 : normal[r] * (depth > 1 ? first.image->GetSpacing(2) : 1.0);
        volume->affine[r][3] = first.origin[r];
    }
    volume->affine[3][3] = 1.0;
    volume_flip_to_ras(volume->affine);
    return volume_set_geometry(volume) || volume_error(error, "bad geometry: axes or distances of the slices are none");
}

bool read_series(const series &chosen, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    std::vector<slice> slices;
    unpacked file = {};
    bool planes = false;
    for (const std::string &name : chosen.files) {
        const size_t before = slices.size();
        if (!read_file(name, slices, error)) {
            return false;
        }
        planes = planes || (slices.size() == before + 1 && depth_of(*slices[before].image) > 1);
    }
    const gdcm::Image &image = *slices[0].image;
    const int depth = planes ? depth_of(image) : 1;
    if (planes && slices.size() > 1) {
        return volume_error(error, "several files with many slices each in one series");
    }
    const int64_t sizes[3] = {int64_t(image.GetDimension(0)), int64_t(image.GetDimension(1)), depth > 1 ? depth : int64_t(slices.size())};
    const bool fine = sort_slices(slices, error) && (slices.size() == 1 || look_at_distances(slices, volume, error))
                   && volume_set_sizes(volume, sizes, 3, 3, frame, error) && place(slices, depth, volume, error)
                   && volume_allocate(volume, error);
    const size_t each = size_t(sizes[0]) * size_t(sizes[1]) * size_t(depth);
    for (size_t k = 0; fine && k < slices.size(); ++k) {
        if (!store_voxels(slices[k], k * each, each, file, volume, error)) {
            return false;
        }
    }
    return fine;
}

} // namespace

bool volume_read_dicom(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    try {
        gdcm::Trace::DebugOff();
        gdcm::Trace::WarningOff();
        gdcm::Trace::ErrorOff();
        std::vector<series> list;
        const series *chosen = find_series(path, list, error) ? choose_series(list, error) : nullptr;
        return chosen && read_series(*chosen, frame, volume, error);
    } catch (const std::exception &problem) {
        return volume_error(error, "%.200s", problem.what());
    }
}

#endif
