mod binutils;
mod capstone;
mod normal;
mod samples;
