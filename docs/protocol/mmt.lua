-- Dissects mmt's messages in Wireshark and tshark, by docs/protocol.md (version 3 of the protocol).
--
--   tshark -X lua_script:mmt.lua -o tls.keylog_file:KEYS -r SESSION.pcap -Y mmt
--
-- Messages inside of QUIC show once Wireshark has the session's keys. A bare message in a UDP datagram shows
-- by its magic, or by "Decode As" mmt (a datagram) or mmt_stream (a message behind its length).
-- Must never show bytes that docs/protocol.md refuses without the expert info mmt.malformed.

local mmt = Proto("mmt", "Model-Mediated Teleoperation")
local mmt_stream = Proto("mmt_stream", "Model-Mediated Teleoperation, stream")
local mmt_quic = Proto("mmt_quic", "Model-Mediated Teleoperation, QUIC datagrams")

mmt.prefs.slave_port = Pref.uint("Slave's UDP port", 4433,
    "Shows which side sent a message; if neither port is this one, senders are not checked")

local malformed = ProtoExpert.new("mmt.malformed.expert", "Not a message",
    expert.group.MALFORMED, expert.severity.ERROR)
mmt.experts = { malformed }

local HEADER_BYTES, DATAGRAM_MAX, STREAM_MAX = 8, 1024, 4096
local VERSION, TEXT_MAX, SAMPLES_MAX, TICK_NS = 3, 64, 32, 1000000
local I32_MIN, I32_MAX = -2147483648, 2147483647
local POSITION_COUNT_M, FORCE_COUNT_N = 1e-7, 1e-4

-- Fields ------------------------------------------------------------------------------------------------

-- By name: mmt.NAME in a display filter.
local fields, listed = {}, {}

local function declare(kind, names, ...)
    for name in names:gmatch("%S+") do
        local label = name:match("[^.]+$"):gsub("_", " ")
        fields[name] = ProtoField[kind]("mmt." .. name, label, ...)
        listed[#listed + 1] = fields[name]
    end
end

declare("string", "magic type")
declare("uint8", "version samples_per_command scene_hz")
declare("uint16", "flags", base.HEX)
declare("uint32", "length number echo.number echo.received newest_update samples.ticks sequence")
declare("uint64", "sent echo.sent echo.held_ns samples.stamp answers")
declare("int32", "samples.x samples.y samples.force_x samples.force_y force.x force.y")
declare("bool", "in_contact stopped energy_holds")
declare("string", "tool_state cause touched_face role claim architecture program friction smoothing correction scheme refusal ending")
declare("bytes", "token resume report")
declare("double", "object tool force in_j port.in_j hip tool_force_max_n stiffness_n_per_m damping_ns_per_m lambda tau_s")

local STATE = "m b c inertia e east north west south x y angle v_x v_y omega"
for name in STATE:gmatch("%S+") do declare("double", "state." .. name) end

declare("string", "malformed")
mmt.fields = listed

-- Reading -----------------------------------------------------------------------------------------------

-- What is thrown when bytes are no message; any other error is a fault of this file and is passed on.
local Refused = {}

local function demand(holds, why)
    if not holds then error(setmetatable({ why = why }, Refused), 0) end
end

-- Takes values from the front of `range` and shows each under `tree`.
local Reader = {}
Reader.__index = Reader

function Reader.new(range, tree)
    return setmetatable({ range = range, length = range:len(), at = 0, tree = tree }, Reader)
end

function Reader:take(count)
    demand(self.at + count <= self.length, "ends too early")
    local taken = self.range:range(self.at, count)
    self.at = self.at + count
    return taken
end

-- A subtree for what `read` takes.
function Reader:group(label, read)
    local from, outer = self.at, self.tree
    local left = self.length - from
    demand(left > 0, "ends too early")
    self.tree = outer:add(mmt, self.range:range(from, left), label)
    read()
    self.tree:set_len(self.at - from)
    self.tree = outer
end

-- A varint of at most `bits` bits: its value as UInt64 and its bytes.
function Reader:varint(bits)
    local from, value, shift = self.at, UInt64(0), 0
    while true do
        local byte = self:take(1):uint()
        local low = byte % 128
        demand(shift + 7 <= bits or low < 2 ^ (bits - shift), "a varint beyond its type")
        value = value:bor(UInt64(low):lshift(shift))
        shift = shift + 7
        if byte < 128 then
            demand(byte ~= 0 or shift == 7, "a varint with needless bytes")
            return value, self.range:range(from, self.at - from)
        end
        demand(shift < bits, "a varint beyond its type")
    end
end

function Reader:u32(name)
    local value, range = self:varint(32)
    value = value:tonumber()
    self.tree:add(fields[name], range, value)
    return value
end

-- A u32 that counts from 1.
function Reader:numbered(name)
    local value = self:u32(name)
    demand(value >= 1, name .. " is 0")
    return value
end

function Reader:u64(name)
    local value, range = self:varint(64)
    self.tree:add(fields[name], range, value)
    return value
end

-- A zigzag varint. Exact up to 2^53, which is far beyond all that is not refused for its size.
function Reader:zigzag(bits)
    local value, range = self:varint(bits)
    local half = value:rshift(1):tonumber()
    local negative = value:band(1):tonumber() == 1
    return negative and -half - 1 or half, range
end

function Reader:f64(name)
    local range = self:take(8)
    local value = range:le_float()
    self.tree:add_le(fields[name], range)
    demand(value == value and math.abs(value) ~= math.huge, name .. " is not a finite number")
    return value
end

function Reader:energy(name)
    demand(self:f64(name) >= 0, name .. " is below 0")
end

function Reader:floats(prefix, names)
    for name in names:gmatch("%S+") do self:f64(prefix .. name) end
end

function Reader:truth(what)
    local range = self:take(1)
    local value = range:uint()
    demand(value <= 1, what .. " is neither 0 nor 1")
    return value == 1, range
end

function Reader:bool(name)
    local value, range = self:truth(name)
    self.tree:add(fields[name], range, value)
end

function Reader:option(name, read)
    if self:truth("the option of " .. name) then read() end
end

function Reader:choice(name, names)
    local value, range = self:varint(32)
    local chosen = names[value:tonumber() + 1]
    demand(chosen, "unknown " .. name .. " " .. tostring(value))
    self.tree:add(fields[name], range, chosen)
    return chosen
end

-- Whether bytes are UTF-8 without control characters (U+0000 to U+001F, U+007F to U+009F).
local function is_plain_utf8(bytes)
    local at = 1
    while at <= #bytes do
        local first, second = bytes:byte(at, at + 1)
        local more, least, most = 0, 0x80, 0xBF
        if first >= 0xC2 and first <= 0xDF then more = 1
        elseif first >= 0xE0 and first <= 0xEF then more = 2
        elseif first >= 0xF0 and first <= 0xF4 then more = 3
        elseif first < 0x20 or first >= 0x7F then return false end
        -- neither C1 controls, over-long forms, surrogates nor beyond U+10FFFF
        if first == 0xC2 or first == 0xE0 then least = 0xA0 end
        if first == 0xF0 then least = 0x90 end
        if first == 0xED then most = 0x9F end
        if first == 0xF4 then most = 0x8F end
        if more > 0 and not (second and second >= least and second <= most) then return false end
        for k = 2, more do
            local byte = bytes:byte(at + k)
            if not (byte and byte >= 0x80 and byte <= 0xBF) then return false end
        end
        at = at + 1 + more
    end
    return true
end

function Reader:text(name)
    local length = self:varint(32):tonumber()
    demand(length <= TEXT_MAX, name .. " is longer than 64 bytes")
    if length == 0 then
        self.tree:add(fields[name], self.range:range(self.at - 1, 1), "")
        return
    end
    local range = self:take(length)
    demand(is_plain_utf8(range:bytes():raw()), name .. " is not UTF-8 without control characters")
    self.tree:add(fields[name], range, range:string(ENC_UTF_8))
end

-- Bodies ------------------------------------------------------------------------------------------------

local function envelope(r)
    local number = r:numbered("number")
    r:u64("sent")
    r:option("echo", function()
        r:group("echo", function()
            r:numbered("echo.number")
            r:u64("echo.sent")
            r:u64("echo.held_ns")
            r:u32("echo.received")
        end)
    end)
    return " #" .. number
end

-- A number of counts, and how much that is.
local function counted(r, name, range, value, count, unit)
    local item = r.tree:add(fields[name], range, value)
    item:append_text(string.format(" (%.7g %s)", value * count, unit))
end

local COUNTED = { { "x", POSITION_COUNT_M, "m" }, { "y", POSITION_COUNT_M, "m" },
    { "force_x", FORCE_COUNT_N, "N" }, { "force_y", FORCE_COUNT_N, "N" } }

-- One sample; `before` holds the one before it and becomes this one.
local function sample(r, first, before)
    if first then
        before.stamp = r:u64("samples.stamp")
    else
        local ticks, range = r:varint(32)
        demand(ticks ~= UInt64(0), "a step of 0 ticks")
        local step = ticks * UInt64(TICK_NS)
        demand(step <= UInt64.max() - before.stamp, "a stamp leaves 64 bits")
        before.stamp = before.stamp + step
        r.tree:add(fields["samples.ticks"], range, ticks:tonumber())
        r.tree:add(fields["samples.stamp"], range, before.stamp)
    end
    for _, entry in ipairs(COUNTED) do
        local name, count, unit = entry[1], entry[2], entry[3]
        local step, range = r:zigzag(first and 32 or 64)
        local value = (first and 0 or before[name]) + step
        demand(value >= I32_MIN and value <= I32_MAX, name .. " leaves 32 bits")
        before[name] = value
        counted(r, "samples." .. name, range, value, count, unit)
    end
end

local function command(r)
    local info = envelope(r)
    r:u32("newest_update")
    local count = r:varint(32):tonumber()
    demand(count >= 1, "no sample")
    demand(count <= SAMPLES_MAX, "more than 32 samples")
    local before = {}
    for k = 1, count do
        r:group("sample " .. k, function() sample(r, k == 1, before) end)
    end
    r:option("port", function()
        r:group("port", function() r:energy("port.in_j") end)
    end)
    return info .. ", " .. count .. " samples"
end

local function tool(r)
    local info = envelope(r)
    r:u64("answers")
    r:group("force", function()
        for _, name in ipairs { "force.x", "force.y" } do
            local value, range = r:zigzag(32)
            counted(r, name, range, value, FORCE_COUNT_N, "N")
        end
    end)
    r:bool("in_contact")
    r:energy("in_j")
    return info
end

local function state(r)
    r:group("state", function() r:floats("state.", STATE) end)
end

local CAUSES = { "deadband", "timer", "master_only_contact", "slave_only_contact", "contact_lost", "every_sample",
  "elsewhere" }
local FACES = { "nothing", "east", "north", "west", "south" }

local function update(r)
    local info = envelope(r)
    local sequence = r:numbered("sequence")
    local cause = r:choice("cause", CAUSES)
    r:u64("answers")
    r:choice("touched_face", FACES)
    state(r)
    return info .. ", update " .. sequence .. " " .. cause
end

local function scene(r)
    local info = envelope(r)
    r:u64("answers")
    r:floats("", "object object object tool tool force force")
    return info
end

local function hello(r)
    r.tree:add(fields.token, r:take(32))
    r:choice("role", { "operator", "observer" })
    if r:choice("claim", { "if_free", "resume", "take_over" }) == "resume" then
        r.tree:add(fields.resume, r:take(32))
    end
    r:floats("", "stiffness_n_per_m damping_ns_per_m")
    r.tree:add(fields.samples_per_command, r:take(1))
    r:choice("architecture", { "mmt", "tdpa" })
    r.tree:add(fields.scene_hz, r:take(1))
    r:floats("", "hip hip")
    r:text("program")
end

local function welcome(r)
    r:floats("", "stiffness_n_per_m damping_ns_per_m")
    r:choice("friction", { "sign", "limit_surface" })
    local smoothing = r:choice("smoothing", { "per_packet", "in_time" })
    r:f64(smoothing == "per_packet" and "lambda" or "tau_s")
    r:choice("correction", { "snap", "matched_stamps", "replay" })
    state(r)
    r:floats("", "tool tool tool_force_max_n")
    r.tree:add(fields.resume, r:take(32))
    r:text("scheme")
    r:text("program")
end

local function refused(r)
    return " " .. r:choice("refusal", { "busy", "wrong_token", "bad_hello", "ending", "wrong_role" })
end

-- The report is opaque: its bytes are for whoever prints it.
local function farewell(r)
    local why = r:choice("ending", { "finished", "interrupted", "failed" })
    local length = r:varint(32):tonumber()
    if length > 0 then r.tree:add(fields.report, r:take(length)) end
    return " " .. why
end

-- Messages ----------------------------------------------------------------------------------------------

local TYPES = {
    [1] = { "command", "master", "datagram", command },
    [2] = { "update", "slave", "datagram", update },
    [3] = { "scene", "slave", "datagram", scene },
    [4] = { "heartbeat", nil, "datagram", envelope },
    [5] = { "tool", "slave", "datagram", tool },
    [16] = { "hello", "master", "stream", hello },
    [17] = { "welcome", "slave", "stream", welcome },
    [18] = { "refused", "slave", "stream", refused },
    [19] = { "farewell", nil, "stream", farewell },
}

-- Which side sent the packet; nil if its ports do not show it.
local function sender(pinfo)
    local slave = mmt.prefs.slave_port
    if pinfo.src_port == pinfo.dst_port then return nil end
    if pinfo.dst_port == slave then return "master" end
    if pinfo.src_port == slave then return "slave" end
    return nil
end

-- Header and body of one message; its name and what to show of it.
local function message(r, road, from)
    demand(r.length <= (road == "datagram" and DATAGRAM_MAX or STREAM_MAX), "longer than may be")
    demand(r.length >= HEADER_BYTES, "shorter than a header")
    local magic, version, number, flags = r:take(4), r:take(1), r:take(1), r:take(2)
    demand(magic:string() == "MMTP", "another magic")
    r.tree:add(fields.magic, magic)
    r.tree:add(fields.version, version)
    demand(version:uint() == VERSION, "version " .. version:uint() .. " of the protocol, not " .. VERSION)
    local kind = TYPES[number:uint()]
    demand(kind, "unknown type " .. number:uint())
    r.tree:add(fields.type, number, kind[1])
    r.tree:add_le(fields.flags, flags)
    local bits = flags:le_uint()
    local tool = math.floor(bits / 2) % 4
    local of_slave = from ~= "master" and tool < 3 and bits < 16
    demand(bits == 0 or (kind[3] == "datagram" and (bits == 1 or of_slave)), "flags that the sender may not set")
    if bits % 2 == 1 then r.tree:add(fields.stopped, flags, true) end
    if tool > 0 then r.tree:add(fields.tool_state, flags, ({ "hold", "disengaged" })[tool]) end
    if bits >= 8 then r.tree:add(fields.energy_holds, flags, true) end
    demand(kind[3] == road, "not by this road")
    demand(not from or not kind[2] or kind[2] == from, "the " .. tostring(from) .. " must not send it")
    local info = kind[4](r) or ""
    demand(r.at == r.length, (r.length - r.at) .. " bytes left after the body")
    return kind[1] .. info
end

-- Shows one message and, if it is none, why. On the stream, `range` begins with the message's length.
local function dissect(range, pinfo, tree, road)
    local top = tree:add(mmt, range)
    local body = range
    if road == "stream" then
        top:add_le(fields.length, range:range(0, 4))
        body = range:range(4)
    end
    local reader = Reader.new(body, top)
    local read, shown = pcall(message, reader, road, sender(pinfo))
    if not read then
        if getmetatable(shown) ~= Refused then error(shown, 0) end
        shown = shown.why
        top:add(fields.malformed, range, shown):add_proto_expert_info(malformed, shown)
        shown = "malformed: " .. shown
    end
    top:append_text(": " .. shown)
    pinfo.cols.protocol = "MMT"
    local info = tostring(pinfo.cols.info)
    local more = info:find("^mmt: ") and info .. "; " or "mmt: "
    pinfo.cols.info = more .. shown
end

function mmt.dissector(buffer, pinfo, tree)
    dissect(buffer:range(), pinfo, tree, "datagram")
    return buffer:len()
end

-- A stream: messages, each behind its length. Asks for more bytes if the last one has not come whole.
function mmt_stream.dissector(buffer, pinfo, tree)
    local at = 0
    while at < buffer:len() do
        local left = buffer:len() - at
        local length = left >= 4 and buffer:range(at, 4):le_uint()
        local bad = length and (length < HEADER_BYTES or length > STREAM_MAX)
        if bad or (pinfo.can_desegment == 0 and left ~= 4 + (length or 0)) then
            local range = buffer:range(at)
            local top, why = tree:add(mmt, range), "the length before the message is not its length"
            top:add(fields.malformed, range, why):add_proto_expert_info(malformed, why)
            return buffer:len()
        end
        if not length or left < 4 + length then
            pinfo.desegment_offset = at
            pinfo.desegment_len = length and 4 + length - left or DESEGMENT_ONE_MORE_SEGMENT
            return buffer:len()
        end
        dissect(buffer:range(at, 4 + length), pinfo, tree, "stream")
        at = at + 4 + length
    end
    return at
end

-- Wireshark hands out the streams of a QUIC connection by its ALPN, but not the datagrams.
local quic_datagrams = Field.new("quic.dg")

function mmt_quic.dissector(_, pinfo, tree)
    for _, found in ipairs { quic_datagrams() } do
        local range = found.range
        if range:len() >= 4 and range:range(0, 4):string() == "MMTP" then
            dissect(range, pinfo, tree, "datagram")
        end
    end
end

register_postdissector(mmt_quic)
DissectorTable.get("quic.proto"):add("mmt/" .. VERSION, mmt_stream)
DissectorTable.get("udp.port"):add_for_decode_as(mmt)
DissectorTable.get("udp.port"):add_for_decode_as(mmt_stream)
mmt:register_heuristic("udp", function(buffer, pinfo, tree)
    if buffer:len() < HEADER_BYTES or buffer:range(0, 4):string() ~= "MMTP" then return false end
    mmt.dissector(buffer, pinfo, tree)
    return true
end)
