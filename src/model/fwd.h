/// Names used across the model.
#pragma once

#include <memory>
#include <string>

namespace mbcosim {

class Model;
class ModelBuilder;
struct State;
struct Scratch;
struct EvalContext;
class Card;
class Registry;
class Drive;
class ScalarFunction;
class Expression;
class Fluid;
class FileDriver;
template <int N>
class Law;
template <int R, int C>
class TplDrive;

using DrivePtr = std::shared_ptr<const Drive>;
using ScalarFunctionPtr = std::shared_ptr<const ScalarFunction>;
using ExpressionPtr = std::shared_ptr<const Expression>;
using FluidPtr = std::shared_ptr<const Fluid>;
using FileDriverPtr = std::shared_ptr<const FileDriver>;  ///< model/drives/file_driver.h
template <int N>
using LawPtr = std::shared_ptr<const Law<N>>;
template <int R, int C = 1>
using TplDrivePtr = std::shared_ptr<const TplDrive<R, C>>;
using Vec3DrivePtr = TplDrivePtr<3>;

}  // namespace mbcosim
