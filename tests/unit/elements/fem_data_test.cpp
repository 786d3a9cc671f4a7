#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "elements/modal/fem_data.h"
#include "elements/modal/modal_body.h"
#include "elements/modal_bodies.h"

namespace mbcosim::fem_data_test {
namespace {

using testing::HasSubstr;

/// The text of a body with one node and two modes; groups can be replaced or left out ("").
std::string body_text(const std::map<int, std::string>& changes = {}) {
  std::map<int, std::string> groups = {
      {1, "** RECORD GROUP 1, HEADER\n**   REVISION, ...\n REV0 1 2 0 0 0\n"},
      {2, "** RECORD GROUP 2, NODES\n tip\n"},
      {5, "** RECORD GROUP 5, X\n 1.5\n"},
      {6, "** RECORD GROUP 6, Y\n 0\n"},
      {7, "** RECORD GROUP 7, Z\n -.25\n"},
      {8,
       "** RECORD GROUP 8, SHAPES\n** 1\n1 0 0\n0 0 0\n** 2\n 0 +1. 0 0 0 2.5E-1 trailing text\n"},
      {9, "** RECORD GROUP 9, MASS\n2 0 0\n3\n"},
      {10, "** RECORD GROUP 10, STIFFNESS\n100 1\n2 200\n"}};
  for (const auto& [group, text] : changes) groups[group] = text;
  std::string all = "** a file\n";
  for (const auto& [group, text] : groups) all += text + "**\n";
  return all;
}

std::string refusal(const std::string& text) {
  try {
    parse_fem_data("body.fem", text);
  } catch (const DeckError& e) {
    return e.diagnostic.file + ":" + std::to_string(e.diagnostic.line) + ": " +
           e.diagnostic.message;
  }
  return "accepted";
}

TEST(FemText, ReadsEveryGroup) {
  const FemData d = parse_fem_data(
      "body.fem", body_text({{3, "** RECORD GROUP 3, Q\n .1 .2\n"},
                             {4, "** RECORD GROUP 4, P\r\n -1\r\n -2\r\n"},
                             {11, "** RECORD GROUP 11, M\n 3 3 3 .1 .2 .3\n"},
                             {12, "** RECORD GROUP 12, RIGID\n 3 1 0 0\n 1 2 3 4 5 6 7 8 9\n"},
                             {13, "** RECORD GROUP   13, C\n1 2 3 4\n** END OF FILE\n garbage"}}));
  EXPECT_EQ(d.labels, std::vector<std::string>{"tip"});
  EXPECT_EQ(d.mode_count(), 2);
  EXPECT_EQ(Vec3(d.positions.col(0)), Vec3(1.5, 0, -.25));
  EXPECT_EQ(d.shapes(0, 0), 1);
  EXPECT_EQ(d.shapes(1, 1), 1);
  EXPECT_EQ(d.shapes(5, 1), .25);
  EXPECT_EQ(d.stiffness(0, 1), 1);  // by rows
  EXPECT_EQ(d.stiffness(1, 0), 2);
  EXPECT_EQ(d.initial_amplitudes(1), .2);
  EXPECT_EQ(d.initial_velocities(0), -1);
  ASSERT_TRUE(d.lumped);
  EXPECT_EQ((*d.lumped)(5, 0), .3);
  ASSERT_TRUE(d.rigid);
  EXPECT_EQ(d.rigid->inertia(0, 1), 2);
  ASSERT_TRUE(d.damping);
  EXPECT_EQ((*d.damping)(1, 0), 3);
  EXPECT_TRUE(d.notes.empty());
}

TEST(FemText, SkipsRejectedModes) {
  const FemData d = parse_fem_data(
      "body.fem",
      body_text(
          {{1, "** RECORD GROUP 1, HEADER\n**\n REV0 1 2 1 0 1\n"},
           {8, "** RECORD GROUP 8\n**\n 9 9 9 9 9 9\n**\n 1 0 0 0 0 0\n**\n 0 1 0 0 0 0\n"}}));
  EXPECT_EQ(d.mode_count(), 2);
  EXPECT_EQ(d.shapes(0, 0), 1);
  EXPECT_EQ(d.shapes(1, 1), 1);
}

TEST(FemText, AcceptsTolerantFormsWithAWarning) {
  const FemData d =
      parse_fem_data("body.fem", body_text({{1, " ** record group 1, HEADER\n REV0 1 2 0 0 0\n"},
                                            {9, "** RECORD GROUP 9\n2 0 0 3\n 4 5\n"}}));
  ASSERT_EQ(d.notes.size(), 3u);
  EXPECT_THAT(d.notes[0].message, HasSubstr("not written `** RECORD GROUP 1`"));
  EXPECT_THAT(d.notes[1].message, HasSubstr("0 comment lines before the data"));
  EXPECT_EQ(d.notes[2].message, "record group 9: values after the last one expected are ignored");
}

TEST(FemText, NamesFileLineAndGroupOfWhatItRefuses) {
  EXPECT_EQ(refusal(body_text({{9, ""}, {7, ""}})), "body.fem:27: record groups are missing: 7, 9");
  EXPECT_EQ(refusal(body_text({{10, "** RECORD GROUP 10\n100 1 2\n"}})),
            "body.fem:31: record group 10: ends after 3 of 4 values");
  EXPECT_EQ(refusal(body_text({{10, "** RECORD GROUP 10\n100 1D2 2 200\n"}})),
            "body.fem:30: record group 10: value 2 of 4 is not a number: \"1D2\"");
  EXPECT_EQ(refusal(body_text({{10, "** RECORD GROUP 10\n100 inf 2 200\n"}})),
            "body.fem:30: record group 10: value 2 of 4 is not finite");
  EXPECT_THAT(refusal(body_text({{2, "** RECORD GROUP 2, NODES\n"}})),
              HasSubstr("record group 2: ends after 0 of 1 node labels"));
  EXPECT_THAT(refusal(body_text({{12, "** RECORD GROUP 9, MASS\n2 0 0\n3\n"}})),
              HasSubstr("record group 9: appears a second time"));
  EXPECT_THAT(refusal(body_text({{12, "** RECORD GROUP 14\n"}})),
              HasSubstr("record group 14 is not supported (an inertia invariant)"));
  EXPECT_THAT(refusal(body_text({{12, "** RECORD GROUP 19\n"}})),
              HasSubstr("record group 19 is not supported (geometric stiffness matrices)"));
  for (const char* group : {"0", "20", "99"})
    EXPECT_THAT(refusal(body_text({{12, "** RECORD GROUP " + std::string(group) + "\n"}})),
                HasSubstr("record group " + std::string(group) + " is not supported"));
  EXPECT_THAT(refusal(body_text({{1, ""}})),
              HasSubstr("record group 2: found before record group 1"));
  EXPECT_THAT(refusal(body_text({{1, "** RECORD GROUP 1\n**\n REV0 1 2 0 0 2\n"}})),
              HasSubstr("must be at least 1, got 0"));
  EXPECT_THAT(refusal(body_text({{1, "** RECORD GROUP 1\n**\n REV0 1 x 0 0 2\n"}})),
              HasSubstr("number of normal modes: an integer is expected"));
  EXPECT_THAT(refusal(body_text({{11, "** RECORD GROUP 11\n 1 1 1 0 -1 0\n"}})),
              HasSubstr("negative mass or inertia at node tip"));
  EXPECT_THAT(refusal(""), HasSubstr("record groups are missing: 1, 2, 5, 6, 7, 8, 9, 10"));
}

TEST(FemText, ChecksCountsBeforeItTakesMemory) {
  EXPECT_THAT(
      refusal(body_text({{1, "** RECORD GROUP 1\n**\n REV0 2000000000 2000000000 0 0 0\n"}})),
      HasSubstr("announces 2000000000 nodes and 2000000000 modes, more than the file can hold"));
  EXPECT_THAT(refusal(body_text(
                  {{1, "** RECORD GROUP 1\n**\n REV0 1 2000000000 2000000000 2000000000 1\n"}})),
              HasSubstr("more than the file can hold"));
}

TEST(FemText, RefusesDuplicateLabels) {
  FemData d = decks::hand_made(true);
  d.labels[2] = "1001";
  EXPECT_EQ(refusal(write_fem_text(d, {})),
            "body.fem:0: record group 2: node label 1001 appears twice");
}

void expect_same(const FemData& a, const FemData& b) {
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.shapes, b.shapes);
  EXPECT_EQ(a.mass, b.mass);
  EXPECT_EQ(a.stiffness, b.stiffness);
  EXPECT_EQ(a.initial_amplitudes, b.initial_amplitudes);
  EXPECT_EQ(a.lumped, b.lumped);
  EXPECT_EQ(a.damping, b.damping);
  ASSERT_EQ(a.rigid.has_value(), b.rigid.has_value());
  if (a.rigid) {
    EXPECT_EQ(a.rigid->inertia, b.rigid->inertia);
  }
}

TEST(FemData, WhatIsWrittenIsReadBack) {
  FemData d = decks::generic_body();
  d.initial_amplitudes << .1, 1.0 / 3, 0;
  d.damping = MatX::Random(3, 3);
  d.rigid = FemRigidInertia{2, Vec3(1, 2, 3), Mat3::Random()};
  expect_same(d, parse_fem_data("x", write_fem_text(d, {"made by a test"})));
  expect_same(d, parse_fem_data("x", write_fem_binary(d)));
}

TEST(FemBinary, HasTheSizeOfTheReferenceFile) {
  EXPECT_EQ(write_fem_binary(decks::hand_made(true)).size(), 652u);
}

TEST(FemBinary, RefusesTruncatedAndInflatedFiles) {
  const std::string bytes = write_fem_binary(decks::hand_made(true));
  for (std::size_t size = 4; size < bytes.size(); size += 7)
    EXPECT_NE(refusal(bytes.substr(0, size)), "accepted") << size;
  std::string huge = bytes;
  huge.replace(9, 4, "\xff\xff\xff\x7f");
  EXPECT_THAT(refusal(huge), HasSubstr("more than the file can hold"));
}

TEST(FemBinary, WarnsOfBytesAfterTheEnd) {
  const std::string bytes = write_fem_binary(decks::hand_made(true));
  EXPECT_TRUE(parse_fem_data("body.bin", bytes).notes.empty());
  const FemData d = parse_fem_data("body.bin", bytes + "xyz");
  ASSERT_EQ(d.notes.size(), 1u);
  EXPECT_EQ(d.notes[0].message, "3 bytes after the end are ignored");
}

TEST(ModalBody, InvariantsOfTheHandMadeBody) {
  const auto b = decks::make_body(decks::hand_made(true), true);
  EXPECT_EQ(b->m, 3);
  EXPECT_TRUE(b->S0.isZero());
  EXPECT_TRUE(b->J0.isApprox(Mat3(Vec3(11, 3, 11).asDiagonal())));
  MatX inv3(3, 2);
  inv3 << 0, 2, 0, 0, 2, 0;
  EXPECT_TRUE(b->inv3.isApprox(inv3));
  EXPECT_TRUE(b->inv4.isZero());
  EXPECT_EQ(b->inv5[1](0, 1), 2);
  EXPECT_EQ(b->inv5[1](1, 0), -2);
  EXPECT_TRUE(b->inv5[0].isZero() && b->inv5[2].isZero());
  EXPECT_TRUE(b->inv8.isZero() && b->inv10.isZero() && b->inv11.isZero());
  const auto inv9 = [&](int j, int k) {
    Mat3 m;
    for (int e = 0; e < 9; ++e) m(e) = b->inv9[e](j, k);
    return m;
  };
  EXPECT_TRUE(inv9(0, 0).isApprox(Mat3(Vec3(-2, -2, 0).asDiagonal())));
  EXPECT_TRUE(inv9(1, 1).isApprox(Mat3(Vec3(0, -2, -2).asDiagonal())));
  Mat3 single = Mat3::Zero();
  single(0, 2) = 2;
  EXPECT_TRUE(inv9(0, 1).isApprox(single));
  EXPECT_TRUE(inv9(1, 0).isApprox(single.transpose()));
}

TEST(ModalBody, RigidInvariantsOfTheGenericBody) {
  const auto b = decks::make_body(decks::generic_body());
  EXPECT_NEAR(b->m, 5.3, 1e-14);
  EXPECT_TRUE((b->S0 / b->m).isApprox(Vec3(0.698113, 0.00943396, 0.0716981), 1e-6));
  Mat3 j;
  j << 0.473, 0.05, -0.42, 0.05, 4.298, 0.03, -0.42, 0.03, 4.475;
  EXPECT_TRUE(b->J0.isApprox(j, 1e-12));
}

/// The modes move the nodes; the moments of the moved nodes are what the invariants give.
TEST(ModalBody, MomentsFollowTheDeformation) {
  const FemData d = decks::generic_body();
  const auto b = decks::make_body(d, true, Vec3(.1, -.2, .3));
  const Vec3 q(.3, -.2, .5);
  Vec3 s = Vec3::Zero();
  Mat3 j = Mat3::Zero();
  for (int i = 0; i < 4; ++i) {
    const Vec3 x = b->positions.col(i) + b->displacement_shapes(i) * q;
    const Mat3 xx = cross<double>(x);
    s += (*d.lumped)(0, i) * x;
    j += Mat3(d.lumped->col(i).tail<3>().asDiagonal()) - (*d.lumped)(0, i) * xx * xx;
  }
  EXPECT_TRUE(b->first_moment(q).isApprox(s, 1e-13));
  EXPECT_TRUE(b->second_moment(q).isApprox(j, 1e-13));
}

TEST(ModalBody, WarnsOfInconsistentMasses) {
  std::vector<std::string> warnings;
  decks::make_body(decks::generic_body(), false, Vec3::Zero(), &warnings);
  EXPECT_TRUE(warnings.empty());
  FemData d = decks::generic_body();
  d.mass *= 2;
  decks::make_body(d, false, Vec3::Zero(), &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("record groups 9 and 11 disagree"));
}

TEST(ModalBody, DampingRules) {
  const FemData d = decks::hand_made(true);
  ModalSelection s;
  s.modes = {1, 2};
  std::vector<std::string> warnings;
  s.damping = {ModalDamping::Kind::rayleigh, .3, .02, {}};
  EXPECT_TRUE(
      make_modal_body(d, s, warnings)->damping.full.isApprox(.3 * d.mass + .02 * d.stiffness));
  s.damping = {ModalDamping::Kind::diagonal, 0, 0, {0, .1}};
  const MatX c = make_modal_body(d, s, warnings)->damping.full;
  EXPECT_EQ(c(0, 0), 0);
  EXPECT_NEAR(c(1, 1), 2 * .1 * std::sqrt(200.0), 1e-14);
  EXPECT_TRUE(warnings.empty());
}

}  // namespace
}  // namespace mbcosim::fem_data_test
