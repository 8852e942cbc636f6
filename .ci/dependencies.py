"""Dependencies held to deny.toml and Cargo.toml without a network: licences, sources, minimum Rust version, features.

Usage: python3 .ci/dependencies.py   (from the project's root; needs cargo and Python 3.11)
"""

import json
import re
import subprocess
import sys
import tomllib


def cargo(*arguments: str) -> str:
    return subprocess.run(["cargo", *arguments], check=True, capture_output=True, text=True).stdout


def permitted(expression: str, allowed: set[str]) -> bool:
    """Whether an SPDX expression can be met by the allowed licences alone. (`/` is the old form of OR.)"""
    tokens = re.findall(r"\(|\)|\bAND\b|\bOR\b|(?:[^\s()]+(?: WITH [^\s()]+)?)", expression.replace("/", " OR "))

    def either() -> bool:
        value = both()
        while tokens and tokens[0] == "OR":
            tokens.pop(0)
            value = both() or value
        return value

    def both() -> bool:
        value = one()
        while tokens and tokens[0] == "AND":
            tokens.pop(0)
            value = one() and value
        return value

    def one() -> bool:
        token = tokens.pop(0)
        if token == "(":
            value = either()
            tokens.pop(0)
            return value
        return token in allowed

    return either()


def version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split("."))


def tree(*arguments: str) -> set[str]:
    """The crates of a build, by name."""
    lines = cargo("tree", "--locked", "--edges", "normal", "--prefix", "none", "--no-dedupe", *arguments).splitlines()
    return {line.split()[0] for line in lines if line.strip()}


deny = tomllib.load(open("deny.toml", "rb"))
allowed = set(deny["licenses"]["allow"])
manifest = tomllib.load(open("Cargo.toml", "rb"))
minimum = version(manifest["package"]["rust-version"])
packages = json.loads(cargo("metadata", "--locked", "--format-version", "1"))["packages"]

problems = []
for package in packages:
    name = f"{package['name']} {package['version']}"
    if not package["license"] or not permitted(package["license"], allowed):
        problems.append(f"{name}: licence {package['license']} is not in deny.toml")
    if package["source"] and "github.com/rust-lang/crates.io-index" not in package["source"]:
        problems.append(f"{name}: comes from {package['source']}, not from crates.io")
    if package["rust_version"] and version(package["rust_version"]) > minimum:
        problems.append(f"{name}: needs Rust {package['rust_version']}, Cargo.toml promises {manifest['package']['rust-version']}")

whole, core = tree(), tree("--no-default-features")
for name in ("clap", "ctrlc", "indicatif", "plotters", "png", "parquet"):
    if name in core:
        problems.append(f"{name} is in the simulation library without features")
print(f"{len(packages)} packages in Cargo.lock; {len(whole)} in the program, {len(core)} in the library without features")
sys.exit("\n".join(problems) or None)
