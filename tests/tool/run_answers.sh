#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tests/tool/run_answers.sh SOURCE SCRATCH: ./run --help, ./run help and a command that there isn't are
# answered where nothing can be installed or built, and build nothing.
set -uo pipefail
source=$1 scratch=$2
rm -rf "$scratch"
mkdir -p "$scratch"/{cmake,tool,bin}
cp "$source/run" "$scratch/"
cp "$source/cmake/bootstrap.sh" "$scratch/cmake/"
cp "$source"/tool/*.hpp "$scratch/tool/"
for program in bash dirname paste sed; do
    ln -s "$(command -v $program)" "$scratch/bin/"
done
wrong=0
expect() { # STATUS TEXT ARGUMENT...: what ./run says
    local status=$1 text=$2 said
    shift 2
    said=$(PATH=$scratch/bin "$scratch/run" "$@" 2>&1)
    if [ $? != "$status" ] || [[ $said != *"$text"* ]]; then
        printf './run %s should say "%s" and exit with %s, but says: %s\n' "$*" "$text" "$status" "$said"
        wrong=1
    fi
}
for help in --help help -h; do
    expect 0 "./run docs" $help
    expect 0 "Commands: pairs bench chapter" $help
done
expect 1 "bnech is not a command; there are pairs bench chapter" bnech -n 10
expect 1 "--fast is not a command" --fast
[ "$(ls "$scratch")" = "$(printf 'bin\ncmake\nrun\ntool')" ] || {
    echo "./run left something behind:" "$scratch"/*
    wrong=1
}
exit $wrong
