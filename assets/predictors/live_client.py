"""Sends poses to `musicworld predict --source osc:9000 --send osc:9001 ...` and prints what it expects.

python3 live_client.py 9000 9001 200      (200 poses, 100 a second)
"""
import math, socket, struct, sys, time

to, back, count = (int(word) for word in sys.argv[1:4])
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind(("127.0.0.1", back))
link.settimeout(0.2)

def string(text):  # ends with one to four zeros, on a multiple of four bytes
    return text + bytes(4 - len(text) % 4)

def read_string(data, at):
    end = data.index(0, at)
    return data[at:end].decode(), end + 4 - end % 4

def messages(bundle):
    at = 16  # behind "#bundle" and its time
    while at < len(bundle):
        size, = struct.unpack_from(">i", bundle, at)
        data, at, values = bundle[at + 4:at + 4 + size], at + 4 + size, []
        address, i = read_string(data, 0)
        types, i = read_string(data, i)
        for kind in types[1:]:
            if kind == "s":
                value, i = read_string(data, i)
            else:
                (value,), i = struct.unpack_from(">" + kind, data, i), i + struct.calcsize(kind)
            values.append(value)
        yield address, values

for i in range(count):
    t = i / 100
    pose = struct.pack(">dfff", t, 0, 1 + 0.2 * math.sin(8 * t), 0)
    link.sendto(string(b"/left") + string(b",dfff") + pose, ("127.0.0.1", to))
    try:
        for address, values in messages(link.recv(4096)):
            print(address, *values)
            if len(values) == 17:  # with yy of the covariance, and radius_50
                print("the 50 % region reaches", (values[12] * values[15]) ** 0.5, "m up and down")
    except socket.timeout:  # the first pose has no answer
        continue
    time.sleep(0.01)
