# Bare Debian machines in folders, for tests/machines and tests/blender/in_roots, which set `root` to the project's folder and
# `folder` to that of the machines, and need root and debootstrap. To be sourced.
fail() { printf '%s: %s\n' "${0#"$root/"}" "$*" >&2; exit 1; }

check_host() {
  [ "$(id -u)" = 0 ] || fail "only root can make a machine"
  command -v debootstrap >/dev/null || fail "debootstrap is missing; Debian's package has this name"
}

# Where this machine has its packages from.
mirror() {
  cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
    sed -nE 's/^URIs: *([^ ]+).*/\1/p; s/^deb +(\[[^]]*\] +)?([^ ]+).*/\2/p' | grep -m 1 '/debian/\?$'
}

suite_of() {  # NAME, which is SUITE, SUITE-plain, newest or arm64
  case $1 in
    newest) echo sid ;;
    arm64) echo trixie ;;
    *) echo "${1%-plain}" ;;
  esac
}

make_machine() {  # NAME
  local machine=$folder/$1 file
  if [ -e "$machine/.made" ]; then return; fi
  debootstrap --variant=minbase --include=ca-certificates "$(suite_of "$1")" "$machine" "$(mirror)"
  mkdir -p "$machine/root/.config"
  for file in etc/apt/apt.conf.d etc/pip.conf etc/ssl/certs usr/local/share/ca-certificates root/.npmrc root/.config/pip; do
    [ ! -e "/$file" ] || cp -a "/$file" "$(dirname "$machine/$file")/"
  done
  touch "$machine/.made"
}

begin() {  # NAME: a machine with a clean clone in /srv/lpdeform
  local machine=$folder/$1
  make_machine "$1"
  cp /etc/resolv.conf /etc/hosts "$machine/etc/"
  mount -t proc proc "$machine/proc"
  mount --rbind /dev "$machine/dev"
  # The C library counts processors there. Where it cannot, gRPC 1.51 may take that error for one of a connection.
  mount --rbind /sys "$machine/sys"
  rm -rf "$machine/srv/lpdeform"
  git clone --quiet "$root" "$machine/srv/lpdeform"
}

on_machine() {  # NAME COMMAND
  local settings
  mapfile -t settings < <(env | grep -E '^(PIP_|npm_config_|SSL_CERT|REQUESTS_CA|NODE_EXTRA_CA|https?_proxy|HTTPS?_PROXY|no_proxy)' || true)
  env -i HOME=/root TERM=dumb LANG=C.UTF-8 PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "${settings[@]}" \
    chroot "$folder/$1" /bin/bash -c "cd /srv/lpdeform || exit 1; $2"
}
